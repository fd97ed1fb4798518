"""Storage of campaigns by kind: `campaign_of_kind` loads the file of its name."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from rbfrag.campaign.kind import CampaignKind
from rbfrag.errors import InputError
from rbfrag.solver.kinds import KINDS


def campaign_kinds() -> tuple[str, ...]:
    """Return the names of the kinds that campaigns support, in alphabetical order."""
    return tuple(sorted(module.name for module in iter_modules(__path__)))


@cache
def campaign_of_kind(kind: str) -> CampaignKind:
    """Return the campaign of a kind by name.

    Raises:
        InputError: there is no such kind, or campaigns do not store it.
    """
    names = campaign_kinds()
    if kind not in names:
        why = KINDS[kind].no_search if kind in KINDS else ""
        raise InputError(
            f"kind {kind}: campaigns are of {', '.join(names)}{': ' if why else ''}{why}",
            fields=("kind",),
        )
    campaign: CampaignKind = import_module(f"{__name__}.{kind}").CAMPAIGN
    return campaign
