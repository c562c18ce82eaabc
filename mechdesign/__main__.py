"""The command `mechdesign`: signals wait until they are heard, before anything else is imported."""


def _command() -> None:
    from mechdesign.cli.app import app

    app()


def main() -> None:
    """Entry point of the `mechdesign` command."""
    import signal

    if hasattr(signal, "pthread_sigmask"):
        numbers = {getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)}
        signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    from mechdesign.cli import process

    process.run(_command)


if __name__ == "__main__":
    main()
