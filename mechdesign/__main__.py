"""The command `mechdesign`: signals wait until they are heard, before anything else is imported."""


def main() -> None:
    """Entry point of the `mechdesign` command."""
    import gc
    import signal

    # What is imported is no garbage: a seventh of a short command's time would go into looking for some.
    gc.disable()
    if hasattr(signal, "pthread_sigmask"):
        numbers = {getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)}
        signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    from mechdesign.door.cli import process

    process.run(_command)


def _command() -> None:
    from mechdesign.door.cli.app import answer

    answer()


if __name__ == "__main__":
    main()
