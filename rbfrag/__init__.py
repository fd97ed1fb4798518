"""Seismic fragility of rock blocks.

Accelerations are in g, velocities in m/s, displacements in m, times in s, p2 in 1/s²,
angles in degrees wherever a name ends in ``_deg``. Names are loaded when first used, so
that ``import rbfrag`` itself costs nothing; the stub ``__init__.pyi`` is their one list.
"""

# lazy_loader.attach_stub does likewise, but reads the stub whenever rbfrag is imported: 4 ms, as
# long as rbfrag itself takes, in every command. Here it is read when a name is first asked for.
_homes: dict[str, str] = {}


def _home_of_names() -> dict[str, str]:
    """Return the module of every public name."""
    if not _homes:
        import re
        from pathlib import Path

        stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
        listed = re.findall(r"^from (\S+) import (\w+) as", stub, re.MULTILINE)
        _homes.update({name: module for module, name in listed})
    return _homes


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    homes = _home_of_names()
    if name == "__all__":
        return sorted(homes)
    if name not in homes:
        raise AttributeError(f"module 'rbfrag' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(homes[name]), name, None)
    if value is None:  # a module, which is imported when it is asked for
        value = import_module(f"{homes[name]}.{name}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(_home_of_names())
