"""A thin driver: every shard is one task on a Dask cluster, and a task is one command."""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import signal
import subprocess
import sys
from collections import Counter

PR_SET_PDEATHSIG = 1  # <linux/prctl.h>


def end_with_parent() -> None:
    """Asks Linux to end the program when the worker that started it dies; on other systems it runs to its end without harm."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def report_of(done: subprocess.CompletedProcess) -> dict | None:
    """The JSON output for a complete shard, whose members may all be rejected (exit code 2); None for an error."""
    try:
        found = json.loads(done.stderr if done.returncode == 2 else done.stdout)
    except ValueError:
        return None
    return found if isinstance(found, dict) and "shards_made" in found else None


def run_shard(program: str, cohort: str, out: str, shard: int, of: int, threads: int) -> dict:
    """Computes one shard, unless it is complete, and returns the program's JSON output.

    Raises ValueError for permanent errors (exit code 2), RuntimeError for all others.
    """
    command = [program, "--json", "--threads", str(threads), "cohort", "run", cohort, "--out", out]
    command += ["--shard", f"{shard}/{of}"]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=end_with_parent)
    report = report_of(done)
    if done.returncode in (0, 2) and report is not None:
        return report
    words = done.stderr.strip() or f"exit code {done.returncode}"
    raise (ValueError if done.returncode == 2 else RuntimeError)(f"shard {shard} of {of}: {words}")


def run_all(client, program, cohort, out, shards, threads=1, retries=3, told=lambda done, of: None):
    """Runs all shards on the cluster of a `distributed.Client`. Returns counts and the errors of shards that failed in the end."""
    from distributed import as_completed

    def submit(shard, attempt):
        # A separate name for each attempt: Dask stores results, and a lost shard must be tested again.
        return client.submit(
            run_shard, program, cohort, out, shard, shards, threads,
            key=f"heart-cohort-{shard}-{attempt}", pure=False, retries=retries,
        )

    futures = {submit(shard, 0): (shard, 0) for shard in range(1, shards + 1)}
    counts, errors = Counter(made=0, skipped=0, repeated=0, members=0, rejected=0), {}
    queue = as_completed(list(futures), raise_errors=False)
    done = 0
    for future in queue:
        shard, attempt = futures.pop(future)
        error = future.exception() if future.status != "finished" else None
        if error is None and future.status == "finished":
            found = future.result()
            counts["made"] += found["shards_made"]
            counts["skipped"] += found["shards_skipped"]
            counts["members"] += found["members"]
            counts["rejected"] += found["rejected"]
        elif not isinstance(error, ValueError) and attempt < retries:
            again = submit(shard, attempt + 1)
            futures[again] = (shard, attempt + 1)
            counts["repeated"] += 1
            queue.add(again)
            continue
        else:
            errors[shard] = str(error)
        done += 1
        told(done, shards)
    return dict(counts), errors


def show(done: int, of: int) -> None:
    """Progress on the standard error, in one line on a terminal."""
    end = "\r" if sys.stderr.isatty() and done < of else "\n"
    print(f"{done} of {of} shards", end=end, file=sys.stderr, flush=True)


def main(arguments=None) -> int:
    """The console entry."""
    parser = argparse.ArgumentParser(prog="heart-cohort-dask", description=__doc__)
    parser.add_argument("cohort", help="the cohort file, accessible to all workers")
    parser.add_argument("--out", required=True, metavar="DIR", help="directory of the shards, accessible to all workers")
    parser.add_argument("--shards", required=True, type=int, metavar="N")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="address of a running cluster, such as tcp://head:8786")
    parser.add_argument("--local", type=int, metavar="N", help="number of worker processes on this machine")
    parser.add_argument("--threads", type=int, default=1, metavar="N", help="concurrent members of a task")
    parser.add_argument("--retries", type=int, default=3, metavar="N")
    parser.add_argument("--program", default="heart-phantom", help="the program, on every worker")
    parser.add_argument("--quiet", action="store_true")
    given = parser.parse_args(arguments)
    if (given.scheduler is None) == (given.local is None):
        parser.error("one of --scheduler and --local")
    if given.shards < 1:
        parser.error("--shards must be at least 1")
    from distributed import Client, LocalCluster

    cohort, out = os.path.abspath(given.cohort), os.path.abspath(given.out)
    cluster = None
    if given.local is not None:
        cluster = LocalCluster(n_workers=given.local, threads_per_worker=1, dashboard_address=None)
    try:
        with Client(cluster or given.scheduler) as client:
            told = (lambda done, of: None) if given.quiet else show
            counts, errors = run_all(
                client, given.program, cohort, out, given.shards, given.threads, given.retries, told
            )
    finally:
        if cluster is not None:
            cluster.close()
    print(json.dumps(counts))
    for shard, words in sorted(errors.items()):
        print(f"error: shard {shard}: {words}", file=sys.stderr)
    if errors:
        return 1
    if counts["rejected"] == counts["members"]:
        print(f"error: all {counts['members']} members are rejected", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
