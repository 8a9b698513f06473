"""Authority: text is shown as it is: on a terminal, in a figure, on a page, in an address, in every encoding.

hypothesis looks for the text that crashes, disappears or acts.
"""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl
import pandas as pd
import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from rich.table import Table
from small_campaign import HEADER, fitted, write

from ident.cli import main
from ident.commands.screen import Screen
from ident.database.store import commit
from ident.text import in_figure, on_screen, visible
from sim.boat.database import digest, read_rows
from sim.files.mirror import handed_over
from sim.files.storage import address

FEW = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
# Surrogates are bytes that are no text, as file names may hold them.
ANY = st.text(st.characters(codec=None), max_size=40) | st.sampled_from(
    [
        "[/]",
        "[red]x[/red]",
        "[/red",
        "\\",
        "\\[",
        "x\\",
        "$",
        "$$",
        r"$\bad$",
        r"\$",
        ":warning:",
        "\x1b[31mred",
        "\x1b]0;t\x07",
    ]
)


def acts(text: str) -> bool:
    return any((ord(c) < 32 and c != "\n") or 127 <= ord(c) < 160 for c in text)


@given(ANY)
def test_what_is_visible_does_not_act_and_is_the_text_where_nothing_would(text):
    shown = visible(text)
    assert not acts(shown)
    assert "\n" not in shown
    shown.encode("utf-8")
    if text.isprintable():
        assert shown == text


@FEW
@given(ANY, st.booleans())
def test_a_console_prints_every_character_of_a_name(text, in_table):
    stream = io.StringIO()
    console = Screen(file=stream, width=4000, color_system=None)
    if in_table:
        table = Table("a", title=on_screen(text))
        table.add_row(f"[bold]{on_screen(text)}[/]")
        console.print(table)
    else:
        console.print(f"[bold]{on_screen(text)}[/]: x", highlight=False)
    # Rich doubles some backslashes; everything else is there as it was.
    assert visible(text).replace("\\", "").strip() in stream.getvalue().replace("\\", "")
    assert "\\" in text or visible(text).strip() in stream.getvalue()
    assert not acts(stream.getvalue())


@FEW
@given(ANY)
def test_a_console_is_not_crashed_or_steered_by_a_name_that_nobody_escaped(text):
    stream = io.StringIO()
    Screen(file=stream, width=4000, force_terminal=False).print(text, highlight=False)
    assert not acts(stream.getvalue())


@FEW
@given(ANY)
def test_a_figure_draws_every_name(text):
    """As a title, as a label and beside mathematics of the program's own."""
    figure = Figure(figsize=(2, 2))
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1], label="x" + in_figure(text))
    axis.set_xlabel(r"$\theta_1$ " + in_figure(text))
    figure.suptitle(in_figure(text))
    figure.legend()
    with mpl.rc_context({"svg.fonttype": "none"}):
        import warnings

        with warnings.catch_warnings():
            # A glyph that the font lacks is drawn as a box.
            warnings.simplefilter("ignore")
            picture, drawing = io.BytesIO(), io.BytesIO()
            figure.savefig(picture, format="png", dpi=30)
            figure.savefig(drawing, format="svg")
    assert picture.getvalue().startswith(b"\x89PNG")
    assert ElementTree.fromstring(drawing.getvalue()).tag.endswith("svg")


def test_a_figure_shows_dollars_as_dollars():
    figure = Figure()
    with mpl.rc_context({"svg.fonttype": "none"}):
        figure.suptitle(in_figure(r"$\bad$ 5 $"))
        stream = io.StringIO()
        figure.savefig(stream, format="svg")
    assert r">$\bad$ 5 $</text>" in stream.getvalue()


@given(ANY)
def test_a_page_holds_every_name_and_no_element_of_it(text):
    from jinja2 import Environment

    page = Environment(autoescape=True).from_string("<p title='{{ x }}'>{{ x }}</p>").render(x=text)
    assert page.count("<") == 2
    assert page.count("'") == 2


TRIAL = Path(__file__).parents[1] / "ident" / "starter" / "files" / "zigzag_trial.csv"


@pytest.mark.skipif(os.name != "posix", reason="POSIX file names")
@given(st.text(st.characters(exclude_characters="/\0", codec="utf-8"), min_size=1, max_size=30))
def test_the_address_of_a_folder_is_the_folder_or_its_mirror(text):
    from urllib.parse import unquote, urlsplit

    path = f"/tmp/{text}/db"
    parts = urlsplit(address(path))
    assert (parts.scheme, parts.netloc, parts.query, parts.fragment) == ("file", "", "", "")
    place = unquote(parts.path)
    assert place == os.path.realpath(path) or not list(Path(place).iterdir())


def run(*arguments: object, **options):
    return CliRunner().invoke(main, [str(a) for a in arguments], **options)


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    return fitted(write(tmp_path_factory.mktemp("small") / "campaign"))


MISREAD = ["proj [v2]", "a|b", "a%20b", "a\\b", "a^b", "a\tb", "\x1b[31m"]


@pytest.mark.parametrize(
    "name", ["proj #?", "C# work", "what?", "100 %", "a%zz", "ü ö", "a`b", "{x}", " x", "a&b=c", "~x"]
)
def test_a_database_works_in_a_folder_of_any_name(tmp_path, name, few):
    works_in(tmp_path, name, few)


@pytest.mark.skipif(os.name != "posix", reason="POSIX file names")
@pytest.mark.parametrize("name", MISREAD)
def test_a_database_works_in_a_folder_that_the_storage_engine_misreads(tmp_path, name, few):
    works_in(tmp_path, name, few)


def works_in(tmp_path: Path, name: str, few: pd.DataFrame) -> None:
    """Two vehicles committed, read back and exported in a folder, beside which nothing comes to lie."""
    folder = tmp_path / name
    write(folder / "campaign")
    if name.startswith("proj"):
        done = run("fit", folder / "campaign", "--db", folder / "db")
        assert done.exit_code == 0, done.output
    else:
        assert commit(str(folder / "db"), few, {}) == (0, True)
    rows = read_rows(str(folder / "db"))[0]
    assert commit(str(folder / "db"), rows.assign(vehicle="suboff"), {}) == (1, True)
    assert digest(read_rows(str(folder / "db"), vehicle="bb2")[0]) == digest(rows)
    for command in (("versions",), ("export", folder / "out"), ("vacuum",), ("doctor",)):
        done = run(*command, "--db", folder / "db")
        assert done.exit_code == 0, done.output
    assert {p.name for p in tmp_path.iterdir()} == {name}
    assert {p.name for p in folder.iterdir()} == {"campaign", "db", "out"}
    assert not [p for p in (folder / "db").rglob("*") if p.is_symlink() or "#" in p.name]


@pytest.mark.skipif(os.name != "posix", reason="POSIX file names")
def test_what_was_not_handed_over_is_not_there_and_an_entry_is_never_replaced(tmp_path):
    db = tmp_path / "proj [v2]"
    db.mkdir()

    def killed():
        with handed_over(db) as mirror:
            (mirror / "part.parquet").write_bytes(b"1")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        killed()
    assert not list(db.iterdir())
    for content in (b"1", b"2"):
        (db / "_delta_log").mkdir(exist_ok=True)
        with contextlib.suppress(FileExistsError), handed_over(db) as mirror:
            (mirror / "_delta_log" / "00000000000000000000.json").write_bytes(content)
            (db / "_delta_log" / "00000000000000000000.json").write_bytes(b"another's")
    assert [p.read_bytes() for p in (db / "_delta_log").iterdir()] == [b"another's"]
    assert not mirror.exists()


@pytest.mark.parametrize("name", ["[/]", "[red]x", "\\u001b]0;owned\\u0007", "潜水艦", ":warning:"])
def test_names_and_messages_come_back_as_they_are(tmp_path, name):
    folder = write(tmp_path / "campaign", header=HEADER.replace('"small"', f'"{name}"'))
    shown = visible(name.encode().decode("unicode_escape") if "\\u" in name else name)
    for command in ("fit", "check", "runs"):
        more = ("--db", tmp_path / "db", "-m", name) if command == "fit" else ()
        done = run(command, folder, *more)
        assert done.exit_code == 0, done.output
        assert shown in done.output
        assert not acts(done.output)
    listed = run("versions", "--db", tmp_path / "db")
    assert listed.exit_code == 0
    assert not acts(listed.output)


def started(*arguments: object, **options):
    return subprocess.run(
        [sys.executable, "-m", "ident.cli", *map(str, arguments)],
        capture_output=True,
        timeout=120,
        check=False,
        **options,
    )


def shell(text: str, env: dict[str, str]):
    return subprocess.run(["bash", "-c", text], capture_output=True, env=env, timeout=120, check=False)


@pytest.mark.skipif(os.name != "posix", reason="locales and descriptors of POSIX")
def test_every_encoding_and_every_end_of_a_stream(tmp_path, fitted_db):
    """A terminal without the characters, another code page, a C locale, a closed and a full output, no folder."""
    folder = write(tmp_path / "campaign", header=HEADER.replace('"small"', '"潜水艦"'))
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    for k, encoding in enumerate(("ascii", "cp1252")):
        done = started("fit", folder, "--db", tmp_path / f"db{k}", env={**env, "PYTHONIOENCODING": encoding})
        assert (done.returncode, done.stderr) == (0, b"")
        assert b"???" in done.stdout
        assert b"committed version 0" in done.stdout
    plain = {**env, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C"}
    done = started("fit", folder, "--db", tmp_path / "db2", "-m", "é".encode().decode(), env=plain)
    assert (done.returncode, done.stderr) == (0, b"")
    listed = started("versions", "--db", tmp_path / "db2", "--json", "-", env=env)
    assert b'"message": "\\u00e9"' in listed.stdout
    command = f'"{sys.executable}" -m ident.cli versions --db "{fitted_db}"'
    for end, code in ((">&-", 0), (">/dev/full", 2), ("| true; exit ${PIPESTATUS[0]}", None)):
        done = subprocess.run(
            ["bash", "-c", f"{command} {end}"], capture_output=True, env=env, timeout=120, check=False
        )
        assert code is None or done.returncode == code
        assert b"Traceback" not in done.stderr
        assert b"Exception ignored" not in done.stderr
    # What standard error takes no more is still a mistake; before the command's name as behind it.
    for words in ("trial nofile", "fit nofolder", "--nosuch", "validate"):
        for end in ("2>&-", "2>/dev/full"):
            done = shell(f'"{sys.executable}" -m ident.cli {words} {end}', env)
            assert (done.returncode, done.stdout) == (2, b""), (words, end)
    done = shell(f'"{sys.executable}" -m ident.cli --version >/dev/full', env)
    assert (done.returncode, done.stderr) == (2, b"Error: standard output: No space left on device\n")
    (tmp_path / "here").mkdir()
    relative = {**env, "XDG_CACHE_HOME": "of/mine", "XDG_CONFIG_HOME": "of/mine"}
    drawn = f'cd "{tmp_path}/here"; "{sys.executable}" -m ident.cli trial "{TRIAL}" --figures "{tmp_path}/figures"'
    assert shell(drawn, relative).returncode == 0
    assert os.listdir(tmp_path / "here") == []
    gone = f'mkdir "{tmp_path}/gone"; cd "{tmp_path}/gone"; rmdir "{tmp_path}/gone"; {command}'
    done = shell(gone, env)
    assert done.returncode == 2
    assert b"working folder" in done.stderr
