"""The time of a record's first sample, as headers write it."""

from __future__ import annotations

import re
from datetime import datetime

_CLOCK = r"(?P<hour>\d{1,2}):\s?(?P<minute>\d{1,2}):\s?(?P<second>\d{1,2})(?:\.(?P<fraction>\d+))?"
_FORMS = (
    re.compile(
        r"(?P<year>\d{4})[/-](?P<month>\d{1,2})[/-](?P<day>\d{1,2})[ T-]\s*" + _CLOCK, re.ASCII
    ),
    re.compile(
        r"(?<!\d)(?P<month>\d{1,2})/\s?(?P<day>\d{1,2})/(?P<year>\d{4}|\d{2}),?\s+" + _CLOCK,
        re.ASCII,
    ),
    re.compile(
        r"(?<!\d)(?P<year>\d{4})(?P<month>\d{2})(?P<day>\d{2})_"
        r"(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2})(?:\.(?P<fraction>\d+))?",
        re.ASCII,
    ),
)

CENTURY_TURNS_AT = 30
"""Two digits of a year below this are of the 21st century, others of the 20th."""

FIRST_YEAR = 1900

NEVER_SET = datetime(1980, 1, 1).date()
"""Where the clocks of recorders begin that were never set: the zero of GPS time."""


def first_sample_time(text: str) -> datetime | None:
    """Return the date and time in a header's text, without its zone; None where there is none.

    Args:
        text: such as ``2020/05/15 11:03:14.418 UTC``, ``8/24/14, 10:20:33.0 UTC`` (month
            first) or ``20230206_011729.868``. An impossible date, or that of a clock that was
            never set, is none.
    """
    found = next((match for form in _FORMS if (match := form.search(text))), None)
    if found is None:
        return None
    year = int(found["year"])
    if len(found["year"]) == 2:
        year += 2000 if year < CENTURY_TURNS_AT else 1900
    try:
        time = datetime(
            year,
            int(found["month"]),
            int(found["day"]),
            int(found["hour"]),
            int(found["minute"]),
            int(found["second"]),
            int(f"{found['fraction'] or '':0<6.6}"),
        )
    except ValueError:
        return None
    return None if time.year < FIRST_YEAR or time.date() == NEVER_SET else time
