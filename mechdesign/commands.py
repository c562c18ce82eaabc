"""The questions that a study may ask, declared once."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

MAX_JOBS = 512  # threads or processes of one command
MERGE = "merge"  # the command that puts shards together


@dataclass(frozen=True)
class Command:
    """One question: a command and a function of the package, both of its name."""

    name: str
    question: str
    answer: str
    room: str = ""  # package of its function, columns and pictures; empty: that of the question of its name
    section: str = ""  # of the study; empty: that of its name
    schema: str = "schema"  # module in its package that has the model of its section

    @property
    def key(self) -> str:
        """The key of its section in a study."""
        return self.section or self.name

    @property
    def model(self) -> Any:
        """The model of its section, `KinematicsSection` of `kinematics`; imported when a study has one."""
        return getattr(import_module(f"{self.package}.{self.schema}"), f"{self.key.capitalize()}Section")

    @property
    def package(self) -> str:
        """The folder of the question."""
        return f"mechdesign.{self.room or f'questions.{self.name}'}"

    @property
    def module(self) -> str:
        """Where the function of its name is; imported when it is asked, for `--help` loads no numerics."""
        return f"{self.package}.{self.name if self.room else 'analysis'}"

    @property
    def columns(self) -> str:
        """Where its columns and the numbers at the top of its report are declared."""
        return f"{self.package}.columns"

    @property
    def figures(self) -> str:
        """Where the function `figures` gathers its pictures."""
        return f"{self.package}.figures{self.room and f'.{self.name}'}"


# Each has a section of its name in the study file.
COMMANDS = {
    command.name: command
    for command in (
        Command(
            "kinematics", "How does it move?", "Positions, velocities, accelerations, Jacobians and limits of motion."
        ),
        Command("workspace", "Where can it work?", "The reachable region, its performance indices and its boundary."),
        Command("optimize", "Which dimensions are best?", "The optimum for each set of weights, and every design."),
        Command(
            "reliability",
            "How precise is it when it is made?",
            "Error moments, reliability and what contributes to them.",
            schema="schema.section",
        ),
        Command(
            "stiffness", "How stiff is it?", "Stiffness and compliance matrices, equivalent springs and deflections."
        ),
        Command(
            "dynamics",
            "What drives it, what does it bear?",
            "Drive efforts, joint forces, shaking forces and energies of a motion.",
        ),
        Command(
            "synthesize",
            "Which linkages do it?",
            "From positions of a body, a function or a path to linkages, each a study.",
            section="synthesis",
        ),
    )
}
SWEEP = Command(
    "sweep",
    "Which cases meet what is required?",
    "Whole studies as a design of experiments: a row a case, with every requirement and chosen results.",
    room="experiments",
    section="matrix",
    schema="schema.matrix",
)
SENSITIVITIES = Command(
    "sensitivities",
    "What does each number change?",
    "Derivatives of chosen results with respect to numbers of the study, with error estimates.",
    room="experiments",
    schema="schema.sensitivities",
)
# Of their cases the questions above are asked.
QUESTIONS = COMMANDS | {SWEEP.name: SWEEP, SENSITIVITIES.name: SENSITIVITIES}
# By the keys of their sections.
SECTIONS = {command.key: command for command in QUESTIONS.values()}
