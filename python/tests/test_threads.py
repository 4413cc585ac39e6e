"""Calls leave the interpreter: other threads run, Ctrl-C ends them, forks compute."""

import os
import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest

from heart_phantom import Phantom, Scene, radon

SMALL = Scene().with_size(32).replace({"camera.views": 12})


def test_other_threads_run_while_a_call_works():
    ticks, done = [0], threading.Event()

    def tick():
        while not done.is_set():
            ticks[0] += 1

    phantom = Phantom(Scene().with_size(64).replace({"camera.views": 30}))
    thread = threading.Thread(target=tick)
    thread.start()
    try:
        before = ticks[0]
        phantom.views()
        after = ticks[0]
    finally:
        done.set()
        thread.join()
    # Without the lock of the interpreter it would get no turn but when the call waits.
    assert after - before > 1000


def test_many_threads_share_a_phantom_and_a_plan():
    phantom = Phantom(SMALL)
    geometry = radon.Geometry.half_turn(12, 32)
    plan = radon.FbpPlan(geometry, radon.Grid.square(32))
    alone = Phantom(SMALL).views(), plan.reconstruct(Phantom(SMALL).views())
    found = [None] * 6

    def work(k):
        views = phantom.views()
        found[k] = (views, plan.reconstruct(views))

    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for views, images in found:
        np.testing.assert_array_equal(views, alone[0])
        np.testing.assert_array_equal(images, alone[1])


LONG = {
    "views": "Phantom(Scene().with_size(256).replace({'camera.views': 2000})).views()",
    "truth": "Phantom(Scene().replace({'truth.tolerance': 1e-6, 'acquisition.accuracy': {'steps': 512}})).truth()",
    "mlem": "mlem(Projector(Geometry.half_turn(256, 256), Grid.square(256)), np.ones((256, 256)), iterations=100000)",
    "run": "Phantom(Scene().with_size(64).replace({'camera.views': 10000})).run(out)",
}


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("what", LONG)
def test_ctrl_c_ends_a_long_call(what, tmp_path):
    # Each of these would take minutes on two cores. What ends it is the signal: the program says so, and goes on.
    program = f"""
        import signal
        import numpy as np
        from heart_phantom import Phantom, Scene
        from heart_phantom.radon import Geometry, Grid, Projector, mlem
        signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored under nohup
        out = {str(tmp_path / "out")!r}
        print("ready", flush=True)
        try:
            {LONG[what]}
        except KeyboardInterrupt:
            print("interrupted", round(Phantom(Scene().with_size(16)).numbers()["edv"]))
        else:
            print("done")
    """
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert child.stdout.readline() == "ready\n"
        threading.Timer(1.0, child.send_signal, (signal.SIGINT,)).start()
        said, errors = child.communicate(timeout=120)
    finally:
        child.kill()
    assert said.startswith("interrupted "), errors
    assert "panic" not in errors.lower()
    if what == "run":
        assert not (tmp_path / "out" / "report.json").exists()
        assert not list((tmp_path / "out").glob("*.tmp"))


def test_what_a_progress_callback_raises_ends_the_call():
    class Enough(Exception):
        pass

    def stop(share):
        assert 0 <= share <= 1
        raise Enough

    phantom = Phantom(Scene().with_size(256))
    with pytest.raises(Enough):
        phantom.views(progress=stop)
    assert phantom.view(0).shape == (256, 256)  # still of use


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_fork_computes_with_threads_of_its_own():
    expected = Phantom(SMALL).views()
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        os.write(write, b"1" if np.array_equal(Phantom(SMALL).views(), expected) else b"0")
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        assert pipe.read() == b"1"
    os.waitpid(child, 0)
