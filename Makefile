# `make demo` and `make test` set everything up by themselves: a virtual environment in .venv.
PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin

.PHONY: demo test lint clean

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(RUN)/python -m pip install --quiet --upgrade pip
	$(RUN)/python -m pip install --quiet --editable ".[view,mesh,test,readers,lint]"
	touch $@

demo: $(VENV)/installed
	PATH="$(CURDIR)/$(RUN):$$PATH" sh samples/conveyor/demo.sh demo

test: $(VENV)/installed
	$(RUN)/python -m pytest -n 2

lint: $(VENV)/installed
	$(RUN)/ruff check .
	$(RUN)/ruff format --check .

clean:
	rm -rf $(VENV) demo build *.egg-info
