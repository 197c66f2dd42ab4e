"""Rounds of experiments on a virtual bench: diagnose, record what tells most, diagnose all together.

OUT/                 results of the latest diagnosis, as of a single one
OUT/campaign-1, ...  the campaign with one recording more, two more ...
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from epv_env.plant.plantfile import Plant
from identification.bench.programmes import Programme, load_programmes
from identification.bench.session import run_bench
from identification.gap.diagnosis import Diagnosis
from identification.gap.verdict import KNOWN, NO_GAP
from identification.recordings.campaign_files import FILE_NAME as CAMPAIGN_FILE
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import CampaignError
from identification.recordings.rules import rules_of
from identification.valve_gap.programmes import CERTAIN
from identification.valve_gap.programmes import FILE_NAME as PROGRAMME


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A virtual bench. The diagnosis gets its recordings only."""

    truth: Plant
    seed: int
    """Of the noise of all recordings that it adds."""

    def check(self, campaign: Path, extended: Path) -> None:
        """Raise CampaignError unless `extended` begins with the recordings of the campaign."""
        own, kept = (read_campaign(each, rules_of(self.truth)) for each in (campaign, extended))
        digests = [recording.digest() for recording in kept.recordings]
        if digests[: len(own.recordings)] != [recording.digest() for recording in own.recordings]:
            raise CampaignError(
                f"{extended} extends another campaign than {campaign}: give another --out"
            )

    def extend(self, campaign: Path, programme: Programme, number: int, extended: Path) -> None:
        """Record a programme, the `number`-th added, and write the campaign with it to `extended`."""
        known = read_campaign(campaign, rules_of(self.truth))
        named = replace(programme, name=f"{programme.name}_round_{number}")
        made = run_bench(
            [named],
            self.truth.parameters,
            seed=int(np.random.default_rng([self.seed, number]).integers(2**32)),
            rate=round(1.0 / known.recordings[0].period, 6),
            rules=known.rules,
        )
        write_campaign(replace(known, recordings=(*known.recordings, *made.recordings)), extended)


@dataclass(frozen=True, kw_only=True)
class Round:
    """A diagnosis, and the recordings it rests on."""

    added: int
    """Recordings added to the campaign so far."""
    campaign: Path
    """Folder of all recordings."""
    found: Diagnosis


def proposed(out: Path) -> Programme | None:
    """The programme that the diagnosis in a folder of results proposes; None where it has none."""
    path = out / PROGRAMME
    return load_programmes(path)[0] if path.exists() else None


def rounds(
    campaign: Path,
    out: Path,
    most: int,
    bench: Bench,
    diagnose: Callable[[Path, Path], Diagnosis],
    choose: Callable[[Path], Programme | None] = proposed,
) -> Iterator[Round]:
    """Each round as it ends, until one answer is certain, `most` recordings are added or none is chosen.

    What an earlier call recorded is not recorded again: the rounds go on from there.

    Args:
        campaign: folder of the first campaign; it stays as it is.
        out: folder of results.
        most: recordings that may be added.
        bench: records them.
        diagnose: diagnoses a campaign's folder and writes the results into another.
        choose: the next programme, from the folder of results.

    Raises:
        CampaignError: `out` holds recordings that extend another campaign.
    """
    added = min(recorded(out), most)
    if added:
        bench.check(campaign, extended_campaign(campaign, out, added))
    while True:
        current = extended_campaign(campaign, out, added)
        found = diagnose(current, out)
        yield Round(added=added, campaign=current, found=found)
        if certain(found) or added >= most:
            return
        programme = choose(out)
        if programme is None:
            return
        added += 1
        bench.extend(current, programme, added, extended_campaign(campaign, out, added))


def extended_campaign(campaign: Path, out: Path, added: int) -> Path:
    """Folder of the campaign with recordings added."""
    return out / f"campaign-{added}" if added else campaign


def recorded(out: Path) -> int:
    """Number of recordings that earlier rounds added in a folder of results."""
    return len(list(out.glob(f"campaign-*/{CAMPAIGN_FILE}")))


def certain(found: Diagnosis) -> bool:
    """Whether one answer, a cause or none, holds the probability from which none need be recorded."""
    conclusion, ranking = found.conclusion, found.ranking
    if conclusion.verdict == NO_GAP:
        return ranking.no_cause >= CERTAIN
    return conclusion.verdict == KNOWN and conclusion.causes[0].probability >= CERTAIN
