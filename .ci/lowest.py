"""The lowest versions that pyproject.toml allows of what users and tests need, as constraints for pip."""

import tomllib
from pathlib import Path

project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
for package in [*project["dependencies"], *project["optional-dependencies"]["test"]]:
    print(package.replace(">=", "=="))
