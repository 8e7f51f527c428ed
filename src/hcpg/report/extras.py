"""The optional packages that reports need, asked for where they are used."""

from importlib.util import find_spec


class MissingExtraError(ModuleNotFoundError):
    """An optional package that is not installed; the message has the command that installs it."""


def require(package: str, extra: str) -> None:
    """Make sure that `package`, which the extra `extra` brings, can be imported.

    Raises:
        MissingExtraError: it is not installed.
    """
    if find_spec(package) is None:
        raise MissingExtraError(f"{package} is not installed. Run: pip install 'hcpg-flow[{extra}]'")
