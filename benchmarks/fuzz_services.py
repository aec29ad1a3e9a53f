"""Malformed and out-of-range messages into vehicles in hold: every message of the dialect and the sequences
of every service, with absurd fields.

    python -m benchmarks.fuzz_services [--messages 1000000] [--seed 0] [--orders] [--jobs 2]

The messages are shared out to both flavours and both classes of vehicle. What is required
(`tests.fuzz.campaign`): no exception, no batch of messages that takes more than 50 ms, a vehicle that keeps
its mode and place whenever no command was sent, and memory that does not grow. Exit code 1: something else
was seen; what, is printed with the seed and the round that shows it again.
"""

import argparse
import itertools
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from tests.fuzz.campaign import Campaign, Figures

FLAVOURS = ("px4", "ardupilot")
MODELS = ("iris", "aerosonde")
GROWTH = 0.05
"""Of resident memory, from the end of the first fifth on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One campaign."""

    flavour: str
    model: str
    seed: int
    messages: int
    orders_only: bool


def fire(job: Job) -> tuple[Job, Figures, float]:
    """Run one."""
    start_s = time.perf_counter()
    campaign = Campaign(job.flavour, job.model, job.seed)
    campaign.run(job.messages, orders_only=job.orders_only, reported=_tell)
    return job, campaign.figures, time.perf_counter() - start_s


def _tell(text: str) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{text}   ")


def growth(memory_bytes: list[int]) -> float:
    """How much larger the end is than the first fifth."""
    if len(memory_bytes) < 5:
        return 0.0
    return max(memory_bytes[-3:]) / max(memory_bytes[: 1 + len(memory_bytes) // 5]) - 1.0


def main() -> int:
    """Fire, and print what was seen."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--messages", type=int, default=1_000_000, help="in all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--flavour", choices=FLAVOURS, help="one flavour alone")
    parser.add_argument("--model", choices=MODELS, help="one model alone")
    parser.add_argument("--orders", action="store_true", help="rounds with commands and parameters only")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    flavours = (arguments.flavour,) if arguments.flavour else FLAVOURS
    models = (arguments.model,) if arguments.model else MODELS
    kinds = list(itertools.product(flavours, models))
    share = -(-arguments.messages // len(kinds))
    jobs = [
        Job(flavour=f, model=m, seed=arguments.seed, messages=share, orders_only=arguments.orders)
        for f, m in kinds
    ]
    failed = False
    start_s = time.perf_counter()
    total = 0
    with ProcessPoolExecutor(arguments.jobs, max_tasks_per_child=1) as pool:
        for job, figures, seconds in pool.map(fire, jobs):
            grown = growth(figures.memory_bytes)
            total += figures.messages
            failed |= bool(figures.complaints) or grown > GROWTH
            sys.stdout.write(
                f"{job.flavour:<10} {job.model:<10} {figures.messages:>8} messages in {seconds:5.0f} s, "
                f"longest batch {1e3 * figures.longest_s:5.1f} ms, "
                f"farthest {figures.farthest_m:4.2f} m, {figures.diverged} diverged, "
                f"memory {100 * grown:+.1f} %\n"
            )
            for complaint in figures.complaints:
                sys.stdout.write(f"  {complaint}\n")
            sys.stdout.flush()
    sys.stdout.write(f"{total} messages in {time.perf_counter() - start_s:.0f} s\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
