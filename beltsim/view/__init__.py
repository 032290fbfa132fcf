"""Pictures of belts, bulk and machine parts, without a display or OpenGL.

A `Scenery` is plain data: boxes, spheres, cylinders and triangles with colours. `png.render_png` draws it by ray
casting, `html.render_html` writes a page in which one can turn it. `deck` and `frame` make sceneries from a Deck
and from a frame of a trajectory. Only numpy is imported until a picture is drawn.
"""

from .camera import Camera, Section
from .scenery import Boxes, Cylinders, Legend, Mesh, Scenery, Spheres

__all__ = ["Boxes", "Camera", "Cylinders", "Legend", "Mesh", "Scenery", "Section", "Spheres"]
