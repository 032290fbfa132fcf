"""Which file is this? Names the formats that people hand over instead of SAT text."""

from __future__ import annotations

import re

# What a file of each format begins with.
_BEGINNINGS = (
    (rb"ACIS BinaryFile", "binary ACIS (SAB)"),
    (rb"ASM BinaryFile", "binary Autodesk ASM (SMB)"),
    (rb"ISO-10303-21", "STEP"),
    (rb"AC10\d\d", "AutoCAD DWG"),
    (rb"\s*0\r?\nSECTION|AutoCAD Binary DXF", "DXF"),
    (rb"\*\*ABCDEFGHIJKLMNOPQRSTUVWXYZ|PS\x00", "Parasolid"),
    (rb"\s*solid[^\n]*\n\s*(facet|endsolid)", "STL"),
    (rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a compound document (Inventor, SolidWorks)"),
    (rb"PK\x03\x04", "a ZIP archive (FCStd, 3MF, F3D)"),
    (rb"\x1f\x8b", "gzip"),
    (rb"%PDF", "PDF"),
    (rb"\{\\rtf", "RTF"),
    (rb"\s*<", "XML or HTML"),
    (rb"version https://git-lfs", "a Git LFS pointer (the file itself was not fetched)"),
    (rb"\s*(#[^\n]*\n\s*)*(mtllib|v |vn |o |g )", "Wavefront OBJ"),
    (rb"\s*(\*\*[^\n]*\n\s*)*\*[A-Za-z]", "an INP deck"),
    (rb"ply\r?\n", "PLY"),
    (rb"glTF", "glTF"),
    (rb"\s*DBRep_DrawableShape|CASCADE Topology", "Open CASCADE BREP"),
    (rb"Version \d+\.\d+ JT|Version.{0,20}JT", "JT"),
)


def foreign_format(data: bytes) -> str | None:
    """Name of the format if `data` is a known one other than SAT text, else None."""
    for pattern, name in _BEGINNINGS:
        if re.match(pattern, data[:4096]):
            return name
    # IGES: fixed lines of 80 columns with the section letter S and a number in the last eight.
    if re.match(rb"[^\n]{72}S *\d+\s*\n", data[:200]):
        return "IGES"
    if b"\x00" in data[:4096]:
        return "binary data"
    return None
