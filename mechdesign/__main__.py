"""``python -m mechdesign``, and the command `mechdesign`: signals are heard before anything else is imported."""

from mechdesign.cli import process


def _command() -> None:
    from mechdesign.cli.app import app

    app()


def main() -> None:
    """Entry point of the `mechdesign` command."""
    process.run(_command)


if __name__ == "__main__":
    main()
