"""Blocks at the sites of an event set: parameters, losses and dependence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import UNKNOWN, Placement
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.fragility.uncertain import normal_product, scatter_steps
from rbfrag.question.classify import numbers_in
from rbfrag.question.components import Component
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Portfolio:
    """Blocks in n rows, sorted by site; each row holds the identical blocks of one table row.

    Args:
        block_ids: names of the rows of the table that the blocks are of.
        site_ids: names of the sites of these rows.
        row: row of the table that each is of, shape (n,).
        count: number of like blocks, each with an azimuth of its own, shape (n,).
        site: index of each block's site, rising, shape (n,).
        numbers: what a model may read of a block, by field, the medians, shape (n,) each; NaN where
            it is not stated.
        size_sigma: standard deviation of the logarithm of its frequency parameter, shape (n,).
        strength_sigma: the same of its yield acceleration, shape (n,).
        weight: what a failure counts, shape (n,).
        loss: what a failure costs in the median, its weight included, shape (n,); None where
            nothing is stated.
        loss_sigma: standard deviation of the logarithm of that, shape (n,).
        model: index of the model that answers for each block, shape (n,).
        models: the models as stored.
        measures: what the models read of the shaking.
        component: what these values mean.
    """

    block_ids: tuple[str, ...]
    site_ids: tuple[str, ...]
    row: IntArray
    count: IntArray
    site: IntArray
    numbers: Mapping[str, FloatArray]
    size_sigma: FloatArray
    strength_sigma: FloatArray
    weight: FloatArray
    loss: FloatArray | None
    loss_sigma: FloatArray
    model: IntArray
    models: tuple[ModelRow, ...]
    measures: tuple[str, ...]
    component: Component

    @classmethod
    def of(
        cls,
        columns: Mapping[str, NDArray[Any]],
        site_ids: Sequence[str],
        models: Mapping[str, FragilityModel],
        component: Component,
    ) -> Portfolio:
        """Return the blocks of a table.

        Args:
            columns: ``block_id`` and ``kind`` of each row that can be used and the numbers that its
                kind reads, such as ``p2_1_s2`` [1/s²] and ``kr``, and, if there are, ``site_id``,
                ``count`` (like blocks, each with an azimuth of its own), ``weight`` (what a
                failure counts), ``loss``, ``loss_sigma`` and standard deviations.
            models: the models that answer, by the kind of blocks.

        Raises:
            InputError: no sites of the blocks, or more blocks than are answered.
        """
        names = columns["block_id"]
        n = len(names)

        def numbers(name: str, missing: float) -> FloatArray:
            return np.asarray(np.nan_to_num(columns.get(name, np.full(n, missing)), nan=missing))

        # Rows are sorted by site, since everything downstream works site by site; `row` restores
        # the order of the table.
        sites = np.zeros(n, dtype=np.int64)
        if "site_id" in columns:
            index = {name: i for i, name in enumerate(site_ids)}
            sites = np.array([index[str(name)] for name in columns["site_id"]], dtype=np.int64)
        elif len(site_ids) != 1:
            raise InputError(
                f"the blocks have no column site_id, and there are {len(site_ids)} sites: name the "
                f"site of each block, such as {', '.join(map(repr, site_ids[:3]))}"
            )
        kinds = columns["kind"].tolist()
        chosen = {kind: models[kind] for kind in dict.fromkeys(kinds)}
        model_index = {kind: i for i, kind in enumerate(chosen)}
        count, weight = numbers("count", 1.0), numbers("weight", 1.0)
        row = np.argsort(sites, kind="stable")
        if len(chosen) == 1 and count.sum() > 1.0:
            # workers get the models as rows: what blocks share is estimated before
            _ = [model.dependence for model in chosen.values()]
        loss = numbers("loss", 0.0) * weight if "loss" in columns else None
        blocks = [chosen[kind].method.block for kind in kinds]
        inputs = numbers_in(columns)
        reads = {name for block in set(blocks) for name in (*block.names, *block.options)}

        def sigma(of: Sequence[str | None]) -> FloatArray:
            """Return the standard deviation of each row's size or strength."""
            names = np.array([f"{name}_sigma" for name in of])
            result = np.zeros(n)
            for name in {*names.tolist()} & {*inputs}:
                rows = names == name
                result[rows] = np.nan_to_num(inputs[name][rows])
            return result[row]

        return cls(
            block_ids=tuple(str(name) for name in names),
            site_ids=tuple(site_ids[i] for i in sites.tolist()),
            row=row,
            count=count.astype(np.int64)[row],
            site=sites[row],
            numbers={
                name: np.asarray(inputs[name], dtype=np.float64)[row]
                for name in sorted(reads & {*inputs})
            },
            size_sigma=sigma([block.size for block in blocks]),
            strength_sigma=sigma([block.strength for block in blocks]),
            weight=weight[row],
            loss=None if loss is None else loss[row],
            loss_sigma=numbers("loss_sigma", 0.0)[row],
            model=np.array([model_index[kind] for kind in kinds], dtype=np.int64)[row],
            models=tuple(model.row for model in chosen.values()),
            measures=tuple(dict.fromkeys(n for m in chosen.values() for n in m.term.inputs)),
            component=component,
        )

    def __getstate__(self) -> dict[str, Any]:
        # models that were read again travel as rows alone: their formulas cannot
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def size(self) -> int:
        """Number of rows n."""
        return self.row.size

    @property
    def mean_loss(self) -> FloatArray | None:
        """Mean loss of a failure, shape (n,): median · exp(sigma²/2)."""
        return None if self.loss is None else self.loss * np.exp(0.5 * self.loss_sigma**2)

    @cached_property
    def dependence(self) -> Dependence | None:
        """Dependence model of failures in one earthquake; None where it is unknown."""
        model = self.answering[0]
        has_dependence = len(self.models) == 1 and model.method.block.size is not None
        return model.dependence if has_dependence else None

    @property
    def remarks(self) -> tuple[str, ...]:
        """Assumptions of the models, each text once."""
        texts: list[str] = []
        for model in self.answering:
            block = model.method.block
            if model.kind == block.kind and block.support:
                texts.append(Diagnostic(block.support, "support_assumed"))
            texts += model.notes
        return tuple(dict.fromkeys(texts))

    @property
    def is_uncertain(self) -> bool:
        """True if parameters of the blocks are uncertain."""
        return bool(self.size_sigma.any() or self.strength_sigma.any())

    @cached_property
    def placement(self) -> Placement:
        """Placement of the blocks in one earthquake, with unknown azimuths."""
        placement = Placement.of_blocks(
            self.answering[0], self.numbers, site=self.site, polarity=UNKNOWN
        )
        assert placement is not None
        return placement

    def scatter_points(self) -> tuple[FloatArray, FloatArray]:
        """Return quadrature points of component, ln p² and ln k_r, shape (k, 3), and their weights.

        What does not scatter has the one point 0.
        """
        sigmas = (float(self.size_sigma.max()), float(self.strength_sigma.max()))
        scatters = (self.component.sigma, *sigmas)
        points, weight = normal_product([scatter_steps(scatter) for scatter in scatters])
        return np.stack(points, axis=1), weight

    @cached_property
    def answering(self) -> tuple[FragilityModel, ...]:
        """The models with their formulas."""
        return tuple(FragilityModel.from_row(row).for_inputs(self.measures) for row in self.models)

    def numbers_of(self, model: FragilityModel, indices: NDArray[np.intp]) -> dict[str, FloatArray]:
        """Return the model inputs of selected blocks, with standard deviations, shape (m,)."""
        block = model.method.block
        read = {*self.numbers} & {*block.names, *block.options}
        numbers = {name: self.numbers[name][indices] for name in read}
        for name, sigma in ((block.size, self.size_sigma), (block.strength, self.strength_sigma)):
            if name is not None and sigma.any():
                numbers[f"{name}_sigma"] = sigma[indices]
        return numbers

    def probability(
        self,
        indices: NDArray[np.intp],
        shaking: Mapping[str, FloatArray],
        points: tuple[FloatArray | float, FloatArray | float, FloatArray | float],
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return P of selected blocks, and whether they are in the fitted range, (..., m).

        Args:
            indices: indices of m blocks.
            shaking: values of the measures, by name, of a shape that broadcasts with (..., m).
            points: standard normal values of the component's scatter, of ln p² and of ln k_r, of
                shapes that broadcast likewise.
        """
        xi, z_p, z_k = points
        shift = np.exp(self.component.sigma * np.asarray(xi))
        values = {n: shaking[n] * shift / self.component.ratio(n) for n in self.measures}
        factors = np.exp(self.size_sigma[indices] * z_p), np.exp(self.strength_sigma[indices] * z_k)
        shape = np.broadcast_shapes(*(array.shape for array in (*values.values(), *factors)))
        p, in_domain = np.empty(shape), np.empty(shape, dtype=np.bool_)
        for number, model in enumerate(self.answering):
            selected, block = self.model[indices] == number, model.method.block
            if not selected.any():
                continue

            def of_these(value: Any, selected: Any = selected) -> Any:
                return np.broadcast_to(value, shape)[..., selected]

            part = {name: of_these(values[name]) for name in model.term.inputs}
            for name in {*self.numbers} & {*block.names, *block.options}:
                part[name] = self.numbers[name][indices][selected]
            for scattered, factor in zip((block.size, block.strength), factors, strict=True):
                if scattered is not None:
                    part[scattered] = part[scattered] * of_these(factor)
            answer = array_answer(model, block.filled(part), interval=False)
            p[..., selected], in_domain[..., selected] = answer.probability, answer.in_domain
        if np.isnan(p).any():
            wrong = int(indices[np.argwhere(np.isnan(p))[0][-1]])
            raise InputError(
                f"block {self.block_ids[self.row[wrong]]}: model "
                f"{self.models[self.model[wrong]].name!r} has no probability for "
                + " and ".join(f"{n} = {v[wrong]:g}" for n, v in self.numbers.items())
            )
        return p, in_domain
