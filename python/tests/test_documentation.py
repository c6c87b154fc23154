"""Docstrings, guide and examples agree with the package, and the stubs with the compiled part."""

import ast
import doctest
import inspect
import json
import os
import pathlib
import re
import runpy

import matplotlib.pyplot as plt
import pytest

import stickslip
from stickslip import _axis, _bench, _cluster, _files, _law, _names, _recording, _results, _running, _runs, _signals, _stickslip, _study, target

ROOT = pathlib.Path(__file__).parents[2]
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL
PUBLIC = {name: getattr(stickslip, name) for name in stickslip.__all__ if name not in ("Controller", "Progress", "__version__")}


def documented():
    """Yield every public function, class and method with its name."""
    for name, item in PUBLIC.items():
        yield name, item
        if inspect.isclass(item):
            for part, member in vars(item).items():
                if not part.startswith("_") and (callable(member) or inspect.isdatadescriptor(member)):
                    yield f"{name}.{part}", member


@pytest.mark.parametrize("name, item", list(documented()))
def test_each_item_has_a_docstring_with_working_examples(name, item):
    text = inspect.getdoc(item)
    assert text and text[0].isupper() or text[0] in '`"', name
    examples = doctest.DocTestParser().get_doctest(text, {"np": __import__("numpy"), **vars(stickslip)}, name, None, 0)
    outcome = doctest.DocTestRunner(optionflags=FLAGS).run(examples)
    assert outcome.failed == 0


def test_a_wrong_example_fails():
    examples = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3", {}, "wrong", None, 0)
    outcome = doctest.DocTestRunner(optionflags=FLAGS).run(examples, out=lambda text: None)
    assert outcome.failed == 1


def test_functions_have_examples_or_are_in_the_guide():
    guide = (ROOT / "docs/src/python.md").read_text()
    for name, item in PUBLIC.items():
        if inspect.isroutine(item):
            assert ">>>" in inspect.getdoc(item) or f"stickslip.{name}(" in guide, name


@pytest.mark.parametrize("page, least", [("docs/src/python.md", 10), ("docs/src/tutorial-python.md", 4), ("README.md", 1)])
def test_the_code_of_the_guide_runs(page, least, tmp_path, monkeypatch):
    text = (ROOT / page).read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= least
    monkeypatch.chdir(tmp_path)
    os.symlink(ROOT / "data", "data")
    names: dict = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)
    plt.close("all")


def test_the_tutorial_states_the_fit():
    text = (ROOT / "docs/src/tutorial-python.md").read_text()
    stated = re.search(r"^```text\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    found = str(stickslip.fit(stickslip.measure(stickslip.preset("clm-bench"))))
    assert stated and stated[1] in found


@pytest.mark.parametrize("example", sorted((ROOT / "python/examples").glob("*.py")), ids=lambda path: path.stem)
def test_an_example_runs(example, monkeypatch, tmp_path):
    # Runs in its own folder, like a notebook.
    (tmp_path / "data").symlink_to(ROOT / "data")
    folder = tmp_path / "python/examples"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    runpy.run_path(str(example), run_name="example")
    plt.close("all")


def notebook(script):
    """The Jupyter notebook of a script whose cells begin with `# %%`."""
    cells = []
    for cell in re.split(r"^# %%", script, flags=re.MULTILINE)[1:]:
        kind, text = cell.split("\n", 1)
        prose = kind.strip() == "[markdown]"
        text = re.sub(r"^# ?", "", text.strip(), flags=re.MULTILINE) if prose else text.strip()
        code = {} if prose else {"execution_count": None, "outputs": []}
        cells.append({"cell_type": "markdown" if prose else "code", "metadata": {}, "source": text.splitlines(keepends=True), **code})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    whole = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


@pytest.mark.parametrize("example", sorted((ROOT / "python/examples").glob("*.py")), ids=lambda path: path.stem)
def test_a_notebook_has_the_cells_of_its_script(example):
    path, expected = example.with_suffix(".ipynb"), notebook(example.read_text())
    if os.environ.get("UPDATE_EXPECT"):
        path.write_text(expected)
    assert path.read_text() == expected, "UPDATE_EXPECT=1 rewrites it"
    # Each code cell must parse separately.
    for cell in json.loads(expected)["cells"]:
        assert cell["cell_type"] == "markdown" or ast.parse("".join(cell["source"])).body


def signatures(text):
    """Return functions and methods of a stub with the names of their parameters."""
    names = {}
    for node in ast.parse(text).body:
        parts = [("", node)] if isinstance(node, ast.FunctionDef) else []
        if isinstance(node, ast.ClassDef):
            names[node.name] = None
            parts = [(f"{node.name}.", part) for part in node.body if isinstance(part, ast.FunctionDef)]
        for prefix, part in parts:
            arguments = part.args
            names[prefix + part.name] = [it.arg for it in arguments.posonlyargs + arguments.args + arguments.kwonlyargs]
    return names


def test_the_stubs_match_the_compiled_part():
    stub = signatures((pathlib.Path(stickslip.__file__).parent / "_stickslip.pyi").read_text())
    for name, item in vars(_stickslip).items():
        if name.startswith("__"):
            continue
        assert name in stub, f"{name} is missing in _stickslip.pyi: regenerate it"
        if inspect.isclass(item):
            for part, member in vars(item).items():
                if not part.startswith("_"):
                    assert f"{name}.{part}" in stub, f"{name}.{part} is missing in _stickslip.pyi: regenerate it"
        else:
            assert stub[name] == list(inspect.signature(item).parameters), name


def test_the_package_has_type_annotations():
    folder = pathlib.Path(stickslip.__file__).parent
    assert (folder / "py.typed").exists()
    for module in (_axis, _bench, _cluster, _files, _law, _names, _recording, _results, _running, _runs, _signals, _study, target):
        for name, item in inspect.getmembers(module, inspect.isfunction):
            if item.__module__ == module.__name__ and not name.startswith("_"):
                missing = set(inspect.signature(item).parameters) - set(item.__annotations__)
                assert not missing and "return" in item.__annotations__, f"{name}: {missing}"
