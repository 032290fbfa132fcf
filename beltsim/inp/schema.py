"""The words in which the keyword table is written: parameter, column, variant, keyword.

Plain descriptions without behaviour of their own; reader, writer, checks and reference page interpret them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


def python_name(name: str) -> str:
    """The Python spelling of an INP name: "SIZE X" is `size_x`."""
    return name.lower().replace(" ", "_")


def inp_name(name: str) -> str:
    """The INP spelling of a Python name: `size_x` is "SIZE X"."""
    return name.upper().replace("_", " ")


@dataclass(frozen=True)
class Interval:
    """A range of numbers, written as in mathematics: "(0, 1]" is above 0 and at most 1."""

    text: str

    def holds(self, values):
        """Whether each of the values (float or array) lies in the range; NaN never does."""
        low, high = (float(bound) for bound in self.text[1:-1].split(","))
        above = values >= low if self.text[0] == "[" else values > low
        return above & (values <= high if self.text[-1] == "]" else values < high)

    def __contains__(self, value: float) -> bool:
        return bool(self.holds(value))

    @property
    def words(self) -> str:
        """The range as a phrase for messages."""
        low, high = (bound.strip() for bound in self.text[1:-1].split(","))
        bounds = []
        if low != "-inf":
            bounds.append(f"{'at least' if self.text[0] == '[' else 'above'} {low}")
        if high != "inf":
            bounds.append(f"{'at most' if self.text[-1] == ']' else 'below'} {high}")
        return " and ".join(bounds)


POSITIVE = Interval("(0, inf)")
NOT_NEGATIVE = Interval("[0, inf)")


@dataclass(frozen=True)
class Parameter:
    """One `NAME=VALUE` of a keyword line.

    kind : what its text holds; `values.py` has a reader and a writer for each
        name      word that names something, case-sensitive        -> str
        text      anything, a file name included                   -> str
        number    float with an optional unit of `dimension`       -> float, SI
        step      AUTO or a number                                 -> "AUTO" or float
        whole     whole number                                     -> int
        choice    one of `choices`                                 -> str
        choices   list out of `choices`                            -> tuple of str
        flag      YES or NO                                        -> bool
        colour    #rrggbb                                          -> str
        vector    three numbers                                    -> tuple of 3 floats
        ids       particle ids and ranges, "1-8, 12"               -> str, for `expand_ids`
    refers : the keyword whose NAME the value must be; `words` are allowed beside names
    wildcards : `*` and `?` in the value match names
    """

    name: str
    kind: str
    doc: str
    dimension: str | None = None
    required: bool = False
    default: Any = None
    choices: tuple[str, ...] = ()
    range: Interval | None = None
    refers: str | None = None
    wildcards: bool = False
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Column:
    """One array of a block's rows, made of `fields` neighbouring fields of each row.

    kind is number, whole, id (a whole number from 0) or quaternion. `least` is the count of fields that must
    be there; those after them may be left out at the end of the row.
    """

    name: str
    fields: tuple[str, ...]
    kind: str = "number"
    unit: str = ""
    range: Interval | None = None
    least: int | None = None

    @property
    def width(self) -> int:
        """Number of fields."""
        return len(self.fields)

    @property
    def required(self) -> int:
        """Number of fields that no row may leave out."""
        return self.width if self.least is None else self.least

    @property
    def is_whole(self) -> bool:
        """Whether the array is int64 instead of float64."""
        return self.kind in ("whole", "id")


@dataclass(frozen=True)
class Variant:
    """What one value of the deciding parameter (a SHAPE, a TYPE) demands, allows and how many rows it takes."""

    required: tuple[str, ...] = ()
    allowed: tuple[str, ...] = ()
    rows: tuple[int, int | None] | None = None


@dataclass(frozen=True)
class Keyword:
    """One keyword: its parameters, its rows and what makes two of its blocks the same thing.

    layout : "columns" (numbers, one array for each column), "text" (lines), "source" (a row for each column,
        then rows `particle type, mass fraction`)
    count : least and largest number of rows, None = any
    key : the parameters that name the thing; () = one in a deck; None = each block is a thing of its own
    symmetric : the two key parameters may be swapped
    decides, variants : the parameter whose value selects the `Variant`
    one_of : of these groups of parameters exactly one is given, and whole
    together : these parameters are given all or none
    """

    name: str
    doc: str
    parameters: tuple[Parameter, ...] = ()
    columns: tuple[Column, ...] = ()
    layout: str = "columns"
    count: tuple[int, int | None] = (0, 0)
    key: tuple[str, ...] | None = None
    symmetric: bool = False
    decides: str | None = None
    variants: tuple[tuple[str, Variant], ...] = ()
    one_of: tuple[tuple[str, ...], ...] = ()
    together: tuple[tuple[str, ...], ...] = ()

    def parameter(self, name: str) -> Parameter | None:
        """The parameter of that canonical name, None if there is none."""
        return next((parameter for parameter in self.parameters if parameter.name == name), None)

    def variant(self, value: str) -> Variant | None:
        """What the value of the deciding parameter asks for, None if nothing is said."""
        return dict(self.variants).get(value)

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the entries of a block's `rows`."""
        names = tuple(column.name for column in self.columns)
        return {"columns": names, "text": ("text",), "source": (*names, "fractions")}[self.layout]
