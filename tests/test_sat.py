"""SAT text: every version's header and records, the traps in it, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from sat_solids import VERSIONS, Body, box, cylinder, write_sat

from partconverter import sat
from partconverter.topology import read_model

DATA = Path(__file__).parent / "data" / "sat"


def simple(version=700, **options) -> str:
    return write_sat([Body([cylinder(133, 380)], "idler"), box((100, 900, 80))], version, **options)


def read(text: str | bytes, name="x.sat") -> sat.SatText:
    return sat.read(text.encode() if isinstance(text, str) else text, name)


def refusal(text: str | bytes) -> str:
    with pytest.raises(sat.SatError) as caught:
        read_model(read(text))
    return str(caught.value)


@pytest.mark.parametrize("version", VERSIONS)
def test_every_version_has_the_same_solids_and_names(version):
    model = read_model(read(simple(version)))
    assert [len(solid.faces) for solid in model.solids] == [3, 6]
    assert [model.name(solid) for solid in model.solids] == ["idler", ""]
    assert model.sat.header.version == version
    assert model.sat.header.unit_mm == (None if version < 200 else 1.0)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    "name", ["idler #7", "a # b #", "End-of-ACIS-data", "$12 -1", "{ @9 }", "Rolle ø 133"]
)
def test_strings_may_hold_anything(version, name):
    text = write_sat([Body([cylinder(133, 380)], name), box((1, 2, 3))], version)
    model = read_model(read(text))
    assert len(model.solids) == 2
    assert model.name(model.solids[0]) == name.strip()


def test_strings_counted_in_bytes_and_in_characters_are_both_read():
    # UTF-8 has two bytes for ø; systems count either.
    text = write_sat([Body([cylinder(133, 380)], "Rolle ø 133 mm")]).encode()
    in_bytes = text.replace(b"@14 Rolle", b"@15 Rolle")
    for data in (text, in_bytes):
        model = read_model(read(data))
        assert model.name(model.solids[0]).startswith("Rolle ø 133")


def test_records_may_run_over_many_lines_or_share_one():
    text = simple()
    head, records = text.split("\n", 3)[:3], text.split("\n", 3)[3]
    for body in (records.replace(" ", "\n\t"), records.replace("#\n", "# ").replace("\n", " ")):
        model = read_model(
            read("\n".join([*head, body.replace("@5\n\tidler", "@5 idler").replace("@4\n\tname", "@4 name")]))
        )
        assert [len(solid.faces) for solid in model.solids] == [3, 6]


@pytest.mark.parametrize(
    "change", [lambda t: t.replace("\n", "\r\n"), lambda t: "\ufeff" + t, lambda t: t + "\x1a\n"]
)
def test_line_ends_byte_order_marks_and_end_of_file_signs_do_not_matter(change):
    assert len(read_model(read(change(simple()))).solids) == 2


def test_utf16_is_read():
    assert len(read_model(read(simple().encode("utf-16"))).solids) == 2


def test_record_numbers_are_followed_and_need_not_be_in_order():
    text = simple(2000, indices=True)
    assert len(read_model(read(text)).solids) == 2
    lines = text.splitlines(keepends=True)
    shuffled = [*lines[:3], *reversed(lines[3:-1]), lines[-1]]
    model = read_model(read("".join(shuffled)))
    assert sorted(len(solid.faces) for solid in model.solids) == [3, 6]


def test_a_wrapped_header_keeps_its_unit():
    # Pro/E breaks the line between a count and its text; the 7 of "ACIS 7.0" must not become the unit.
    lines = simple().splitlines(keepends=True)
    lines[1] = "10 Sample CAD 8 ACIS 7.0 24 \nMon Jan 05 08:00:00 2026\n"
    lines[2] = "25.4 1e-06 1e-10\n"
    assert read("".join(lines)).header.unit_mm == 25.4


@pytest.mark.parametrize(
    "product",
    [
        "99 Home made 3 ACIS 7.0 1 never",
        "Home made, no counts at all",
        "@33 Open Design Alliance ACIS Builder @12 ACIS 32.0 NT @24 Sat Apr 23 14:35:11 2022",
        "16 Autodesk AutoCAD 20 ASM 227.0.0.65535 NT 0 ",
    ],
)
def test_the_unit_is_found_behind_any_product_line(product):
    lines = simple().splitlines(keepends=True)
    lines[1], lines[2] = f"{product}\n", "10 9.9999999999999995e-07 1e-10\n"
    text = read("".join(lines))
    assert text.header.unit_mm == 10
    assert len(text.kinds) > 50


def test_a_unit_of_minus_one_means_unknown():
    lines = simple().splitlines(keepends=True)
    lines[2] = "-1 9.9999999999999995e-07 1e-10\n"
    assert read("".join(lines)).header.unit_mm is None


def test_history_is_left_out():
    text = simple()
    history = "Begin-of-ACIS-History-Data\n-0 delta_state 1 1 $-1 $-1 #\nEnd-of-ACIS-History-Section\n"
    with_history = text.replace("End-of-ACIS-data", history + "End-of-ACIS-data").replace(
        "700 0 2 0", "700 0 2 1"
    )
    pointing = with_history.replace("body $1 -1 $-1 ", "body $1 -1 $9999 ", 1)
    for data in (with_history, pointing):
        assert len(read_model(read(data)).solids) == 2


def test_tolerant_edges_and_vertices_are_followed():
    text = simple()
    for old, new in (
        ("\ncoedge ", "\ntcoedge-coedge "),
        ("\nedge ", "\ntedge-edge "),
        ("\nvertex ", "\ntvertex-vertex "),
    ):
        text = text.replace(old, new)
    # Tolerant edges carry their tolerance and newer ones more pointers behind it.
    text = text.replace("@7 unknown #", "@7 unknown 0.001 $-1 #")
    model = read_model(read(text))
    face = model.face(model.solids[0].faces[1])
    assert [forward for _, forward in face.edges] == [True, False]


def test_real_files_hold_what_their_sources_say():
    faces = {
        path.name: [len(s.faces) for s in read_model(read(path.read_bytes())).solids]
        for path in DATA.glob("*.sat")
    }
    assert faces == {
        "dagmc_cylinder.sat": [3],
        "dagmc_cones.sat": [32],
        "nist_mallet.sat": [5],
        "ezdxf_cube777.sat": [6],
        "ezdxf_prism.sat": [10],
        "knut_ro460_ri300_w44_sym.sat": [],
    }


@pytest.mark.parametrize("version", [400, 500, 600, 700])
def test_another_reader_finds_the_same_records(version):
    ezdxf_sat = pytest.importorskip("ezdxf.acis.sat")
    text = simple(version)
    theirs = ezdxf_sat.parse_sat(text).entities
    ours = read(text)
    assert [entity.name for entity in theirs] == ours.kinds


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (b"ACIS BinaryFile\x08\x00\x00", "SAB"),
        (b"ASM BinaryFile4\x00\x00", "SMB"),
        (b"ISO-10303-21;\nHEADER;\n", "STEP"),
        (b"solid belt\n facet normal 0 0 1\n", "STL"),
        (b"AC1032\x00\x00", "DWG"),
        (b"  0\nSECTION\n  2\nHEADER\n", "DXF"),
        (b"**ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz**\n", "Parasolid"),
        (b"PK\x03\x04\x14\x00", "ZIP"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\x00", "Inventor"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS"),
        (b"*FORMAT, NAME=BELTSIM, VERSION=1\n", "INP"),
        (b"v 0 0 0\nv 1 0 0\n", "OBJ"),
        (b" " * 72 + b"S      1\n", "IGES"),
        (b"\x1f\x8b\x08\x00", "gzip"),
        (b"%PDF-1.7\n", "PDF"),
        (b"<html>\n", "HTML"),
        (b"", "empty"),
        (b"\x01\x02\x00\x03", "binary"),
        (b"hello world\n", "expected the four numbers of a SAT header"),
    ],
)
def test_other_formats_are_refused_by_name(data, name):
    message = refusal(data)
    assert name in message
    assert message.startswith("x.sat:1: ")


@pytest.mark.parametrize("version", [106, 400, 700, 2600, 22700])
def test_a_text_that_breaks_off_is_refused_wherever_it_does(version):
    text = simple(version).rstrip()
    for end in range(0, len(text) - 1, 61):
        assert refusal(text[:end])


def test_a_text_without_end_mark_is_read_if_all_announced_records_are_there():
    text = simple(200).rsplit("End-of-ACIS-data", 1)[0]
    count = len(read(simple(200)).kinds)
    assert len(read(text.replace("200 0 2 0", f"200 {count} 2 0", 1)).kinds) == count
    assert "breaks off" in refusal(text.replace("200 0 2 0", f"200 {count + 1} 2 0", 1))


def test_errors_name_the_line_and_come_all_at_once():
    lines = simple().splitlines(keepends=True)
    faces = [i for i, line in enumerate(lines) if line.startswith("face ")]
    for i in faces[:2]:
        words = lines[i].split()
        words[6] = "$9999"
        lines[i] = " ".join(words) + "\n"
    message = refusal("".join(lines))
    for i in faces[:2]:
        assert f"x.sat:{i + 1}: found" in message


def test_a_pointer_of_the_wrong_type_is_refused():
    text = simple()
    lines = text.splitlines(keepends=True)
    loop = next(i for i, line in enumerate(lines) if line.startswith("loop "))
    words = lines[loop].split()
    words[-2] = "$0"
    lines[loop] = " ".join(words) + "\n"
    assert f"x.sat:{loop + 1}: found a loop that points at no face" in refusal("".join(lines))


def test_text_behind_the_end_mark_is_reported():
    text = read(simple() + simple())
    assert "not read" in text.warnings[0]
