# HCPG-Flow. Every target works from any folder, twice in a row, and without network after the first time.
# ARGS passes options on: make demo ARGS="--seeds 0 1 2", make test ARGS="tests/selection -x".
ROOT := $(shell cd "$$(dirname "$(strip $(MAKEFILE_LIST))")" && pwd)
PYTHON_OF_PROJECT := .venv/bin/python
# What a shell set up for another project (a ROS workspace, say) must not reach this one's packages. Containers
# often forbid Python to keep its bytecode: each of the many processes here would compile every source anew.
unexport PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE
# Two test processes share two cores: one thread each for NumPy, which pytest plug-ins load; the rest is in tests/conftest.py.
TEST_SETTINGS := OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1

.DEFAULT_GOAL := help
.PHONY: help install demo twin test bench lint format lock

help: ## Show the targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/  make \1\t\2/p' "$(ROOT)/Makefile"

install: ## Install what the demo and training need into .venv
	@"$(ROOT)/scripts/install.sh" run

demo: install ## Train hcpg_flow and sac_flow side by side on a Meta-World task (under 10 minutes on 2 cores)
	@cd "$(ROOT)" && scripts/prepare_rendering.sh && $(PYTHON_OF_PROJECT) scripts/demo.py $(ARGS)

twin: install ## Make the environment of the served twin, .venv-twin, and add the arm's driver to .venv
	@"$(ROOT)/scripts/install_twin.sh"

test: ## Run the tests
	@"$(ROOT)/scripts/install_system_packages.sh" sapien opengl vulkan browser
	@"$(ROOT)/scripts/install.sh" run test
	@cd "$(ROOT)" && $(TEST_SETTINGS) $(PYTHON_OF_PROJECT) -m pytest -n 2 --dist loadfile --no-loadscope-reorder $(ARGS)

bench: ## Measure the speed against the peers, on this machine
	@"$(ROOT)/scripts/install.sh" run bench
	@cd "$(ROOT)" && $(PYTHON_OF_PROJECT) scripts/bench.py $(ARGS)

lint: ## Check style, formatting and types
	@"$(ROOT)/scripts/install.sh" run test lint
	@cd "$(ROOT)" && $(PYTHON_OF_PROJECT) -m ruff check .
	@cd "$(ROOT)" && $(PYTHON_OF_PROJECT) -m ruff format --check .
	@cd "$(ROOT)" && $(PYTHON_OF_PROJECT) -m pyright

format: ## Rewrite the code in the project's format
	@"$(ROOT)/scripts/install.sh" run test lint
	@cd "$(ROOT)" && $(PYTHON_OF_PROJECT) -m ruff check --fix . && $(PYTHON_OF_PROJECT) -m ruff format .

lock: install ## Resolve requirements/*.txt anew (needs the network)
	@"$(ROOT)/scripts/lock.sh"
