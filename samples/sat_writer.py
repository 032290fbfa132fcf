"""SAT text as CAD systems write it, in any save version from 1.6 to the newest and Autodesk's ASM.

>>> Path("frame.sat").write_text(write_sat([cylinder(133, 380, (0, 0, 300), (0, 1, 0)), box((100, 900, 80))]))
"""

from __future__ import annotations

from typing import NamedTuple

from solids import Body, Solid, box, cross, cylinder, revolve, roller

__all__ = ["Body", "Solid", "box", "cylinder", "revolve", "roller", "write_sat"]


def write_sat(solids, version=700, unit_mm=1.0, *, product="Sample CAD", indices=False) -> str:
    """SAT text of solids and bodies.

    `version` is the save version (106 ... 3100; 20000 and above is ASM); one drawing unit has `unit_mm`
    millimetres; `indices` puts each record's number before it, as Abaqus does.
    """
    bodies = [item if isinstance(item, Body) else Body([item]) for item in solids]
    text = _Text(version)
    if text.asm:
        text.add("header", "asmheader", "$-1 -1", text.string("229.3.0.65535"))
    for number, body in enumerate(bodies):
        _body(text, (number,), body)
    lines = text.lines(indices)
    end = f"End-of-{'ASM' if text.asm else 'ACIS'}-data \n"
    return "".join([_header(text, len(bodies), unit_mm, product), *lines, end])


def _header(text, bodies, unit_mm, product) -> str:
    first = f"{text.version} 0 {bodies + text.asm} {4 if text.asm else 0} \n"
    if text.version < 200:
        return first
    release = f"{'ASM' if text.asm else 'ACIS'} {text.version / 100:.1f} NT"
    words = (product, release, "Mon Jan 05 08:00:00 2026")
    second = " ".join(f"{len(word)} {word}" for word in words)
    key = f"T @52 {'K4' * 26} \n" if text.version >= 2600 and not text.asm else ""
    return f"{first}{second} \n{unit_mm:.17g} 9.9999999999999995e-07 1e-10 \n{key}"


class _To(NamedTuple):
    """A pointer to the record of `key`; null where no such record exists."""

    key: object


class _Text:
    """Records in file order; pointers stay keys until every record has its place."""

    def __init__(self, version):
        self.version = version
        self.asm = version >= 20000
        self.places = {}
        self.records = []
        self.tags = 0

    def add(self, key, kind, *fields):
        self.places[key] = len(self.records)
        self.records.append((kind, fields))

    def lines(self, indices):
        for number, (kind, fields) in enumerate(self.records):
            words = [f"-{number}" if indices else "", kind, *map(self._word, fields), "#\n"]
            yield " ".join(filter(None, words))

    def _word(self, field) -> str:
        if isinstance(field, _To):
            return f"${self.places.get(field.key, -1)}"
        if isinstance(field, str):
            return field
        return " ".join(f"{value + 0.0:.17g}" for value in field)

    def string(self, text) -> str:
        return f"{'@' if self.version >= 700 else ''}{len(text)} {text}"

    def tag(self) -> str:
        """The number that ASM gives to faces, edges and vertices."""
        self.tags += self.asm
        return f"{self.tags - 1}"

    def head(self, attribute=None, tag="-1"):
        """The fields that every record but `transform` begins with."""
        if self.version < 700:
            return (_To(attribute),)
        rest = f"{tag} $-1" if self.asm or self.version < 1600 else "-1 -1 $-1"
        return _To(attribute), rest

    def since(self, version, word, *, asm=False) -> str:
        """`word` from a save version on; in ASM text, which left ACIS at 7.0, only if `asm`."""
        return word if (asm if self.asm else self.version >= version) else ""

    def box(self) -> str:
        return self.since(1600, "F")


def _body(text, key, body):
    lumps = [(*key, i) for i in range(len(body.solids))]
    name, transform = (*key, "name"), (*key, "transform")
    zero = text.since(2800, "0")
    text.add(key, "body", *text.head(name), zero, _To(lumps[0]), "$-1", _To(transform), text.box())
    if body.name:
        links = ("$-1 $-1", _To(key), text.since(1600, "2 1 1 1 1 1 1 1 1 1 1 1 1 1 0 1 1 1"))
        words = (text.string("name"), text.string(body.name))
        text.add(name, "string_attrib-name_attrib-gen-attrib", *text.head(), *links, *words)
    if body.matrix or body.scale != 1 or any(body.shift):
        _transform(text, transform, body)
    for i, solid in enumerate(body.solids):
        _lump(text, lumps[i], solid, key, lumps[i + 1] if i + 1 < len(lumps) else None)


def _transform(text, key, body):
    a, b, c = body.matrix or ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    mirrored = sum(x * y for x, y in zip(cross(a, b), c)) < 0
    flags = {"rotate": bool(body.matrix), "reflect": mirrored, "shear": body.shear}
    if text.version < 200:
        words = [str(int(flag)) for flag in flags.values()]
    else:
        words = [word if flag else f"no_{word}" for word, flag in flags.items()]
    head = "$-1" if text.version < 700 else "$-1 -1"
    text.add(key, "transform", head, (*a, *b, *c, *body.shift, body.scale), *words)


def _lump(text, key, solid, body, follower):
    shells = [(*key, "shell", i) for i in range(len(solid.shells))]
    text.add(key, "lump", *text.head(), _To(follower), _To(shells[0]), _To(body), text.box())
    users = _users(solid, shells)
    for i, faces in enumerate(solid.shells):
        _shell(text, shells[i], faces, key, shells[i + 1] if i + 1 < len(shells) else None, solid, users)
    _edges(text, key, solid, users)


def _users(solid, shells) -> dict:
    """For each edge the keys of its coedges."""
    users = {}
    for shell, faces in zip(shells, solid.shells):
        for f, face in enumerate(faces):
            for n, loop in enumerate(face.loops):
                for c, (edge, _) in enumerate(loop):
                    users.setdefault(edge, []).append((*shell, f, n, c))
    return users


def _shell(text, key, faces, lump, follower, solid, users):
    wire = "$-1" if text.version >= 200 else ""
    head = (*text.head(), _To(follower), "$-1", _To((*key, 0)), wire)
    text.add(key, "shell", *head, _To(lump), text.box())
    surfaces = {}
    for i, face in enumerate(faces):
        surface = surfaces.setdefault(face.surface, (*key, i, "surface"))
        _face(text, (*key, i), face, surface, solid)
        for n, loop in enumerate(face.loops):
            _loop(text, (*key, i, n), loop, users)


def _face(text, key, face, surface, solid):
    *shell, number = key
    sense = "reversed" if face.is_reversed else "forward"
    sides = "double out" if solid.sides == "double" else "single"
    links = (_To((*shell, number + 1)), _To((*key, 0)), _To(tuple(shell)), "$-1", _To(surface))
    text.add(key, "face", *text.head(tag=text.tag()), *links, sense, sides, text.box(), text.box())
    if surface not in text.places:
        _surface(text, surface, face.surface)


def _surface(text, key, surface):
    values, old = surface.values, text.version < 200
    if surface.kind == "cone":
        scale = values[12:] if text.version >= 400 else ()
        fields = (values[:10], "I I", values[10:12], scale, "0" if old else "forward")
    else:
        fields = (values, "0" if old else "forward_v")
    text.add(key, f"{surface.kind}-surface", *text.head(), *fields, "I I I I")


def _loop(text, key, loop, users):
    *face, number = key
    links = (_To((*face, number + 1)), _To((*key, 0)), _To(tuple(face)))
    text.add(key, "loop", *text.head(), *links, text.box(), text.since(1600, "unknown"))
    lump = key[:2]
    for i, (edge, forward) in enumerate(loop):
        coedge, others = (*key, i), users[edge]
        partner = others[(others.index(coedge) + 1) % len(others)] if len(others) > 1 else None
        around = ((*key, (i + 1) % len(loop)), (*key, (i - 1) % len(loop)), partner, (*lump, "edge", edge))
        words = ("forward", "reversed") if text.version >= 220 else ("0", "1")
        zero = text.since(99999, "0", asm=True)
        fields = (*map(_To, around), words[not forward], _To(key), zero, "$-1")
        text.add(coedge, "coedge", *text.head(), *fields)


def _edges(text, lump, solid, users):
    vertices = {}
    for i in users:
        edge, key = solid.edges[i], (*lump, "edge", i)
        _edge(text, key, lump, edge, users[i][0])
        vertices.setdefault(edge.start, key)
        vertices.setdefault(edge.end, key)
    zero = text.since(99999, "0", asm=True)
    for number, edge in vertices.items():
        key = (*lump, "vertex", number)
        text.add(key, "vertex", *text.head(tag=text.tag()), _To(edge), zero, _To((*key, "point")))
        text.add((*key, "point"), "point", *text.head(), solid.vertices[number])


def _edge(text, key, lump, edge, coedge):
    low, high = ((edge.low,), (edge.high,)) if text.version >= 500 else ((), ())
    start, end = (_To((*lump, "vertex", number)) for number in (edge.start, edge.end))
    word = text.string("unknown") if text.version >= 500 else ""
    curve = (*key, "curve")
    fields = (start, low, end, high, _To(coedge), _To(curve), "0" if text.version < 200 else "forward", word)
    text.add(key, "edge", *text.head(tag=text.tag()), *fields, text.box())
    if edge.curve is not None:
        text.add(curve, f"{edge.curve.kind}-curve", *text.head(), edge.curve.values, "I I")
