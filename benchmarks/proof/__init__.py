"""Outcomes of toppling blocks proven by validated integration, and a third oracle beside them."""

from benchmarks.page import ROOT

PAGE = ROOT / "docs" / "evidence" / "certificate.md"
