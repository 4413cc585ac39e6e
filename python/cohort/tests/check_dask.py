"""40 shards on two Dask workers, one of which is killed with SIGKILL in mid-run, against a serial run: every byte.

    python check_dask.py PROGRAM       the program heart-phantom; needs requirements.txt

Exit code 0 if all checks pass.
"""

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "src"))
SHARDS, MEMBERS = 40, 80
COHORT = f"""members = {MEMBERS}
seed = 11
[scene]
heart.discretisation = {{ differences = {{ nodes = 201 }} }}
camera = {{ views = 24, bins = 32, rows = 32, pitch = [0.6, 0.6] }}
acquisition.mode = {{ gated = {{ gates = 8 }} }}
output.write = ["projections", "truth"]
[vary]
heart.inner.radius = {{ uniform = [1.5, 2.0] }}
heart.outer.radius = {{ choice = [2.7, 2.9, 1.4] }}
"""


def sums(folder):
    """SHA-256 of every file of a folder."""
    found = {}
    for name in sorted(os.listdir(folder)):
        with open(os.path.join(folder, name), "rb") as file:
            found[name] = hashlib.sha256(file.read()).hexdigest()
    return found


def kill_one(client, out, killed):
    """Waits for a fifth of the shards, and kills the first worker process."""
    pids = list(client.run(os.getpid).values())
    while not os.path.isdir(out) or sum(name.endswith(".json") for name in os.listdir(out)) < SHARDS // 5:
        time.sleep(0.01)
    os.kill(pids[0], signal.SIGKILL)
    killed.append(pids[0])


def main():
    program = os.path.abspath(sys.argv[1])
    from distributed import Client, LocalCluster

    from heart_cohort.dask_driver import run_all

    with tempfile.TemporaryDirectory() as folder:
        cohort, serial, out = (os.path.join(folder, name) for name in ("cohort.toml", "serial", "out"))
        with open(cohort, "w") as file:
            file.write(COHORT)
        command = [program, "--json", "--threads", "1", "cohort", "run", cohort, "--out", serial]
        subprocess.run([*command, "--shard", f"all/{SHARDS}"], check=True, stdout=subprocess.DEVNULL)
        # Some shards exist already, as after an earlier run, and are skipped.
        subprocess.run([*command[:-1], out, "--shard", f"7/{SHARDS}"], check=True, stdout=subprocess.DEVNULL)
        killed = []
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            with Client(cluster) as client:
                killer = threading.Thread(target=kill_one, args=(client, out, killed))
                killer.start()
                counts, errors = run_all(client, program, cohort, out, SHARDS, retries=3)
                killer.join()
        assert killed, "no worker was killed"
        assert not errors, errors
        assert counts["made"] + counts["skipped"] == SHARDS, counts
        assert counts["skipped"] >= 1 and counts["members"] == MEMBERS and counts["rejected"] > 0, counts
        subprocess.run([program, "--quiet", "cohort", "merge", out], check=True)
        subprocess.run([program, "--quiet", "cohort", "merge", serial], check=True)
        expected, found = sums(serial), sums(out)
        assert sorted(expected) == sorted(found), sorted(set(expected) ^ set(found))
        assert not [name for name in found if name.endswith(".tmp")]
        assert expected == found, [name for name in found if found[name] != expected[name]]
        subprocess.run([program, "--quiet", "cohort", "verify", cohort, "--out", out], check=True)
        # Another run: nothing is computed.
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            with Client(cluster) as client:
                again, errors = run_all(client, program, cohort, out, SHARDS)
        assert not errors and again["skipped"] == SHARDS and again["made"] == 0, (again, errors)
        print(json.dumps({"killed": killed, "first run": counts, "second run": again, "files equal": len(found)}))


if __name__ == "__main__":
    main()
