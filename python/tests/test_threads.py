"""Calls leave the interpreter: other threads run, Ctrl-C ends them, forks compute."""

import os
import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest

from heart_phantom import Phantom, Scene, radon, revolve

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
    # If the call kept the lock of the interpreter, this thread would run only while the call waits.
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


# Each is prepared, then interrupted: (preparation, call).
LARGE = "g, s = Geometry.half_turn(2048, 1024), Grid.square(1024)"
CAMERA = "Geometry.full_turn(360, 192), Grid.square(192), 192, 1.0, 150.0, collimator={'holes': 'ge-lehr', 'intrinsic_fwhm': 0.4}"
ROD = "body = Body([[[0.0, 3.0]] + [[k / 200, 3.0 + 0.1 * np.sin(k)] for k in range(1, 2000)]])"
LONG = {
    "views": ("phantom = Phantom(Scene().with_size(256).replace({'camera.views': 2000}))", "phantom.views()"),
    "views_of_gates": (
        "phantom = Phantom(Scene().with_size(256).replace({'camera.views': 2000, 'acquisition.mode': {'gated': {'gates': 8}}}))",
        "phantom.views_of_gates()",
    ),
    "view behind a collimator": (
        "phantom = Phantom(Scene().with_size(256).replace({'camera.views': 2000}, collimator={'holes': 'ge-lehr', 'intrinsic_fwhm': 0.4}))",
        "phantom.views()",
    ),
    "truth": (
        "phantom = Phantom(Scene().replace({'truth.tolerance': 1e-6, 'acquisition.accuracy': {'steps': 512}}))",
        "phantom.truth()",
    ),
    "activity": ("phantom = Phantom(Scene().with_size(512).replace({'truth.tolerance': 1e-7}))", "phantom.activity(0.3)"),
    "labels": ("phantom = Phantom(Scene().with_size(512).replace({'truth.tolerance': 1e-7}))", "phantom.labels(0.3)"),
    "motion": ("phantom = Phantom(Scene().with_size(512))", "phantom.motion(0.3)"),
    "volume": ("phantom = Phantom(Scene().with_size(256).replace({'camera.views': 2000}))", "phantom.volume()"),
    "reconstruct": (
        "phantom = Phantom(Scene().with_size(256).replace({'camera.views': 2000})); y = np.ones((2000, 256, 256), np.float32)",
        "phantom.reconstruct(y)",
    ),
    "reconstruct by OSEM": (
        "phantom = Phantom(Scene().with_size(128).replace({'reconstruction.method': {'osem': {'subsets': 8, 'iterations': 100,"
        " 'attenuation': True, 'resolution': True}}, 'camera.views': 120}, attenuation={'coefficient': 0.15, 'medium': 'heart'},"
        " collimator={'holes': 'ge-lehr', 'intrinsic_fwhm': 0.4})); y = np.ones((120, 128, 128), np.float32)",
        "phantom.reconstruct(y)",
    ),
    "scatter": (
        "phantom = Phantom(Scene().replace(attenuation={'coefficient': 0.15, 'medium': 'heart'}, scatter={'tolerance': 0.001}))",
        "phantom.scatter()",
    ),
    "mlem": ("p = Projector(Geometry.half_turn(256, 256), Grid.square(256))", "mlem(p, np.ones((256, 256)), iterations=100000)"),
    "forward": (f"{LARGE}; x = np.ones((32, 1024, 1024), np.float32); p = Projector(g, s)", "p.forward(x)"),
    "adjoint": (f"{LARGE}; y = np.ones((2048, 32, 1024), np.float32); p = Projector(g, s)", "p.adjoint(y)"),
    "strip": (f"{LARGE}; y = np.ones((2048, 1024)); p = Projector(g, s, 'strip')", "p.adjoint(y)"),
    "fbp": (f"{LARGE}; y = np.ones((2048, 48, 1024), np.float32); p = FbpPlan(g, s, method='direct')", "p.reconstruct(y)"),
    "fbp by Fourier": (f"{LARGE}; y = np.ones((2048, 48, 1024), np.float32); p = FbpPlan(g, s, method='fourier')", "p.reconstruct(y)"),
    "fbp adjoint": (f"{LARGE}; x = np.ones((48, 1024, 1024), np.float32); p = FbpPlan(g, s, method='direct')", "p.adjoint(x)"),
    "osem": (f"{LARGE}; y = np.ones((2048, 16, 1024), np.float32); p = Projector(g, s)", "osem(p, y, 8, iterations=1000)"),
    "SpectOperator": ("a = np.full((192, 192, 192), 0.15)", f"SpectOperator({CAMERA}, attenuation=a)"),
    "spect": (f"p = SpectOperator({CAMERA}, attenuation=np.full((192, 192, 192), 0.15)); x = np.ones(p.image_shape)", "p.forward(x)"),
    "spect adjoint": (f"p = SpectOperator({CAMERA}); y = np.ones(p.data_shape, np.float32)", "p.adjoint(y)"),
    "spect osem": (
        f"p = SpectOperator({CAMERA}, attenuation=np.full((192, 192, 192), 0.15)); y = np.ones(p.data_shape, np.float32)",
        "osem(p, y, 8, iterations=1000)",
    ),
    "coverage": (ROD, "body.coverage((600, 600, 600), 0.02, tolerance=1e-6)"),
    "chords": (f"{ROD}; x = np.random.default_rng(1).normal(size=(4000000, 3))", "body.chords(x, [1.0, 0.2, 0.3])"),
    "mesh": (ROD, "body.mesh(tolerance=1e-7)"),
    "signed_distances": (f"{ROD}; x = np.random.default_rng(1).normal(size=(40000000, 3))", "body.signed_distances(x)"),
    "body.views": (ROD, "body.views(np.linspace(0, 3, 500), 2048, 2048, (0.005, 0.005), [1.0])"),
    "run": ("phantom = Phantom(Scene().with_size(64).replace({'camera.views': 10000}))", "phantom.run(out)"),
}
# CPU seconds that each of the two threads of an abandoned call may use. Not seconds of the clock, which depend on the load of the machine.
MOST_AFTER = 0.5


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("what", LONG)
def test_ctrl_c_ends_a_long_call(what, tmp_path):
    # Each of these would take many seconds on two cores. The signal ends it: the program reports this, its threads end, and it continues.
    before, call = LONG[what]
    program = f"""
        import signal, time
        import numpy as np
        from heart_phantom import Phantom, Scene, set_threads
        from heart_phantom.radon import FbpPlan, Geometry, Grid, Projector, SpectOperator, mlem, osem
        from heart_phantom.revolve import Body
        set_threads(2)
        signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored under nohup
        out = {str(tmp_path / "out")!r}
        {before}
        print("ready", flush=True)
        try:
            {call}
        except KeyboardInterrupt:
            used, last = time.process_time(), -1.0
            while time.process_time() - last > 0.01:  # while other threads work
                last = time.process_time()
                time.sleep(0.5)
            print("interrupted", time.process_time() - used)
            assert Phantom(Scene().with_size(16)).numbers()["edv"] > 0
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
    assert said.startswith("interrupted "), (said, errors)
    assert float(said.split()[1]) < 2 * MOST_AFTER
    assert "panic" not in errors.lower()
    if what == "run":
        assert not (tmp_path / "out" / "report.json").exists()
        assert not list((tmp_path / "out").glob("*.tmp"))


G, S = radon.Geometry.full_turn(12, 20), radon.Grid.square(16)
P, PLAN, BALL = radon.Projector(G, S), radon.FbpPlan(G, S), revolve.Body([[[0.0, 1.0], [3.0, 0.0]]])
SPECT = radon.SpectOperator(G, S, 4, 1.0, 20.0)
HEART = Phantom(SMALL.replace({"acquisition.mode": {"gated": {"gates": 2}}}, attenuation={"coefficient": 0.15, "medium": "heart"}))
REPORTS = {
    "views": lambda tell: HEART.views(progress=tell),
    "view": lambda tell: HEART.view(1, progress=tell),
    "scatter": lambda tell: HEART.scatter(progress=tell),
    "views_of_gates": lambda tell: HEART.views_of_gates(progress=tell),
    "meshes": lambda tell: HEART.meshes(0.3, progress=tell),
    "artefacts": lambda tell: HEART.artefacts(np.ones((32, 32, 32)), np.ones((32, 32, 32)), progress=tell),
    "volume": lambda tell: HEART.volume(progress=tell),
    "reconstruct": lambda tell: HEART.reconstruct(np.ones((12, 32, 32)), progress=tell),
    "slice": lambda tell: HEART.slice(3, progress=tell),
    "truth": lambda tell: HEART.truth(progress=tell),
    "truth_slice": lambda tell: HEART.truth_slice(3, progress=tell),
    "truth_of_gates": lambda tell: HEART.truth_of_gates(progress=tell),
    "activity": lambda tell: HEART.activity(0.3, progress=tell),
    "attenuation": lambda tell: HEART.attenuation(0.3, progress=tell),
    "labels": lambda tell: HEART.labels(0.3, progress=tell),
    "motion": lambda tell: HEART.motion(0.3, progress=tell),
    "forward": lambda tell: P.forward(np.ones((3, 16, 16)), progress=tell),
    "adjoint": lambda tell: P.adjoint(np.ones((12, 20)), progress=tell),
    "fbp": lambda tell: radon.fbp(np.ones((12, 20)), G.angles, progress=tell),
    "plan": lambda tell: PLAN.reconstruct(np.ones((12, 3, 20)), progress=tell),
    "plan.adjoint": lambda tell: PLAN.adjoint(np.ones((3, 16, 16)), progress=tell),
    "SpectOperator": lambda tell: radon.SpectOperator(G, S, 4, 1.0, 20.0, progress=tell),
    "spect.forward": lambda tell: SPECT.forward(np.ones(SPECT.image_shape), progress=tell),
    "spect.adjoint": lambda tell: SPECT.adjoint(np.ones(SPECT.data_shape), progress=tell),
    "osem": lambda tell: radon.osem(P, np.ones((12, 20)), 3, iterations=2, progress=tell),
    "cgls": lambda tell: radon.cgls(SPECT, np.ones(SPECT.data_shape), iterations=2, progress=tell),
    "chords": lambda tell: BALL.chords(np.ones((3000, 3)), [0.0, 1.0, 0.0], progress=tell),
    "line_integrals": lambda tell: BALL.line_integrals(np.ones((3000, 3)), [0.0, 1.0, 0.0], [1.0], progress=tell),
    "signed_distances": lambda tell: BALL.signed_distances(np.ones((3000, 3)), progress=tell),
    "body.views": lambda tell: BALL.views([0.0, 1.0], 9, 9, (0.5, 0.5), [1.0], progress=tell),
    "coverage": lambda tell: BALL.coverage((20, 20, 20), 0.2, progress=tell),
    "mesh": lambda tell: BALL.mesh(progress=tell),
}


@pytest.mark.filterwarnings("ignore:the scene attenuates")
@pytest.mark.parametrize("what", REPORTS)
def test_calls_report_their_progress(what):
    told = []
    REPORTS[what](told.append)
    assert told == sorted(told)
    assert 0 <= told[0] and told[-1] == 1.0


WATER = {"coefficient": 0.15, "medium": "heart"}
SLOW = {
    "view": lambda tell: Phantom(
        Scene().with_size(128).replace({"acquisition.accuracy": {"steps": 512}}, collimator={"holes": "ge-lehr", "intrinsic_fwhm": 0.4})
    ).view(0, progress=tell),
    "scatter": lambda tell: Phantom(Scene().with_size(32).replace(attenuation=WATER, scatter={"tolerance": 0.01})).scatter(progress=tell),
}


@pytest.mark.parametrize("what", SLOW)
def test_progress_advances_during_a_call(what):
    # Each takes more than ten times the interval between two reports.
    told = []
    SLOW[what](told.append)
    assert len({fraction for fraction in told if 0.1 < fraction < 1}) > 2, told


def test_an_exception_of_a_progress_callback_ends_the_call():
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
def test_a_fork_computes_with_separate_threads():
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
