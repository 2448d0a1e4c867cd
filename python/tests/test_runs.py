"""Floor 1: whole runs, the same as the command line's."""

import contextlib
import json
import multiprocessing
import os
import pickle
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import dalean


def command(*arguments, **options):
    program = os.path.join(os.path.dirname(sys.executable), "dalean")
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False, **options)


def settings(keys):
    return [part for key, value in keys.items() for part in ("--set", f"{key}={json.dumps(value)}")]


def trained(out, keys, threads=1):
    return dalean.train(keys, out=out, threads=threads, progress=False).state_hash


def test_a_run_has_the_bits_of_the_command_line(tmp_path, small):
    done = command("train", *settings(small), "--json", "--threads", 1, "--out", tmp_path / "c")
    assert done.returncode == 0, done.stderr
    wanted = json.loads(done.stdout.splitlines()[-1])["state_hash"]
    assert [trained(tmp_path / f"p{threads}", small, threads) for threads in (1, 2)] == [wanted] * 2
    for method in ("fork", "spawn"):
        for threads in (1, 2):
            with multiprocessing.get_context(method).Pool(1) as pool:
                assert pool.apply(trained, (tmp_path / f"{method}{threads}", small, threads)) == wanted


def test_a_run_knows_what_its_folder_says(tmp_path, small):
    run = dalean.train(small, out=tmp_path, progress=False)
    assert [record["epoch"] for record in run.metrics] == [0, 1]
    assert run.receipt["status"] == "finished" and 0.3 < run.accuracy <= 1
    assert run.evaluate() == run.accuracy
    verdict = run.verify(progress=False)
    assert verdict and verdict.epochs == 2 and verdict.state_hash == run.state_hash
    assert "level_bits = 8" in run.config
    levels = run.levels()
    assert levels["layer0.pp"].shape == (64, 16) and levels["layer1.np"].shape == (16, 10)
    report = run.report()
    assert "<html" in report.html and "<iframe" in report._repr_html_() and str(report)
    price = run.price()
    assert price["made_on"] == "ideal" and run.price("reram")["priced_as"] == "reram"
    with pytest.raises(dalean.RunError, match="finished"):
        dalean.resume(run.path)
    # a changed number is found
    ledger = run.path / "metrics.jsonl"
    ledger.write_text(ledger.read_text().replace('"updates":', '"updates":1', 1))
    with pytest.raises(dalean.RunError):
        run.verify(progress=False)


FLAWS = {
    "hw.device.faults.stuck_any": 0.05,
    "hw.device.read_noise.sigma_cells": 2.0,
    "hw.device.programming.sigma": [0.03],
    "hw.device.drift": {"start_s": 20.0, "change": -0.03, "change_spread": 0.02},
}


def told_by_eval(path, *arguments):
    """Rows and summaries of the command line."""
    done = command("eval", path, "--json", "--threads", 1, *arguments)
    assert done.returncode == 0, done.stderr
    *lines, last = map(json.loads, done.stdout.splitlines())
    rows = [{name: line[name] for name in line if name != "event"} for line in lines if line["event"] == "chip"]
    return rows, last["results"], last["of"]


def test_chips_are_those_of_the_command_line(tmp_path, small):
    """Rows and quantiles to the last bit: on several chips at several moments, on one chip, and on the one that learnt."""
    run = dalean.train(small, out=tmp_path, progress=False)
    keys = settings({key: value for key, value in FLAWS.items() if not isinstance(value, dict)})
    keys += settings({f"hw.device.drift.{key}": value for key, value in FLAWS["hw.device.drift"].items()})
    asked = {"overrides": FLAWS, "progress": False}
    chips = run.on_chips(samples=3, after=["1d", 3e7], compensate=True, **asked)
    rows, summary, of = told_by_eval(run.path, "--samples", 3, "--after", "1d,30000000s", "--compensate", *keys)
    assert (chips.rows, chips.summary, chips.of) == (rows, summary, of) and len(chips) == 6
    assert chips["after_s"][:2] == [86_400, 3e7] and len(set(chips["test_accuracy"])) > 3
    assert "<table" in chips._repr_html_() and "3 chips" in repr(chips) and list(chips)[0]["chip"] == 1
    # a chip is found again by its number, whatever was read before and by how many threads
    assert run.on_chips(chip=2, after="1d", compensate=True, threads=2, **asked).rows == rows[2:3]
    assert run.on_chips(chip=2, after=86_400, **asked).rows == told_by_eval(run.path, "--chip", 2, "--after", "1d", *keys)[0]
    # the one that learnt, as it is
    assert run.on_chips(progress=False)["test_accuracy"] == [run.accuracy]
    short = {key.removeprefix("hw."): value for key, value in FLAWS.items()}
    assert run.on_chips(chip=7, overrides=short, progress=False).rows == run.on_chips(chip=7, **asked).rows
    # what only pulses have to do with is not looked at, and that is said
    with pytest.warns(UserWarning, match="it is not looked at"):
        chips = run.on_chips(samples=2, hw="aihwkit_pcm", progress=False)
    assert (chips.rows, chips.summary, chips.of) == told_by_eval(run.path, "--samples", 2, "--hw", "aihwkit_pcm")
    pandas = pytest.importorskip("pandas")
    assert isinstance(chips.to_pandas(), pandas.DataFrame) and list(chips.to_pandas()["chip"]) == [1, 2]


def test_chips_of_a_policy_have_returns(tmp_path):
    keys = {"task": "policy", "environment": {"steps": 64, "count": 2, "horizon": 16, "rollouts": 1}, "network.hidden": [4]}
    run = dalean.train({**keys, "evaluation.final_episodes": 4}, out=tmp_path, progress=False)
    flaws = {"hw.device.faults.stuck_any": 0.3}
    chips = run.on_chips(samples=2, overrides=flaws, progress=False)
    assert (chips.rows, chips.summary, chips.of) == told_by_eval(run.path, "--samples", 2, *settings(flaws))
    assert chips.of == "return_mean" and min(chips["return_mean"]) >= 1


@pytest.mark.parametrize(
    ("asked", "where", "words"),
    [
        ({"samples": 2}, "samples", "chips of this kind are all alike"),
        ({"after": "1d"}, "hw.device.drift", "is missing"),
        ({"compensate": True}, "compensate", "say with after when chips are read"),
        ({"overrides": {"hw.adc.bits": 4}}, "overrides", "changes what cells and reads do"),
        ({"overrides": {"device.response.states": 9}}, "overrides", "gives no pulses"),
        ({"hw": "reram"}, "hw", "names reram, which has none"),
        ({"hw": "epiram"}, "hw", "response alone"),
        ({"hw": "no/such.toml"}, None, "no/such.toml"),
        ({"after": 1, "overrides": FLAWS}, "after", "levels are of 20 s after programming"),
        ({"after": ["1d", "soon"]}, "after", "has 'soon'"),
        ({"after": [None]}, "after", "has None"),
        ({"after": float("nan")}, "after", "has nan"),
        ({"samples": 0}, "samples", "is 0"),
        ({"samples": 1.5}, "samples", "1 to 1000000"),
        ({"chip": -1}, "chip", "is -1"),
        ({"chip": 2**64}, "chip", "is 18446744073709551616"),
        ({"chip": 1, "samples": 1}, "chip", "beside samples"),
    ],
)
def test_what_changes_nothing_on_a_chip_is_refused(shared_run, asked, where, words):
    with pytest.raises(dalean.ConfigError, match=words) as caught:
        shared_run.on_chips(**asked, progress=False)
    assert where is None or caught.value.where == where
    assert "--" not in str(caught.value)


@pytest.fixture(scope="module")
def shared_run(tmp_path_factory):
    keys = {"network.hidden": [4], "learning.epochs": 1, "data.set": "xor"}
    return dalean.train(keys, out=tmp_path_factory.mktemp("runs"), progress=False)


def test_a_file_and_overrides(tmp_path, small):
    file = tmp_path / "mine.toml"
    file.write_text("[network]\nhidden = [16]\n[learning]\nepochs = 1\nbatch = 32\ntaps = 2\n")
    nested = {"learning": {"taps": None}, "seed": 5}
    assert dalean.train(file, nested, tmp_path / "a").state_hash == trained(tmp_path / "b", small)
    assert "seed = 5" in dalean.configuration(file, nested)


def test_errors_say_where_what_and_what_is_allowed():
    with pytest.raises(dalean.ConfigError) as caught:
        dalean.configuration(overrides={"hw.cell.level_bits": 99})
    error = caught.value
    assert (error.where, error.found) == ("hw.cell.level_bits", "is 99")
    assert "1..=12" in error.allowed and error.try_ and "99" in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error) and again.where == error.where and str(again) == str(error)
    with pytest.raises(dalean.ConfigError, match="did you mean `batch`"):
        dalean.configuration(overrides={"learning.batchh": 9})
    with pytest.raises(dalean.ConfigError, match="cannot be read"):
        dalean.train("no/such.toml")
    with pytest.raises(dalean.ConfigError, match="a set"):
        dalean.train({"seed": {1}})
    with pytest.raises(dalean.DataError, match="is not in"):
        dalean.train({"data.set": "mnist"}, data="nowhere")
    with pytest.raises(dalean.RunError, match="no folder of a run"):
        dalean.Run("nowhere")
    with pytest.raises(dalean.RunError, match="1 to 1024"):
        dalean.train(threads=0)
    assert issubclass(dalean.ConfigError, ValueError) and issubclass(dalean.NetworkError, dalean.Error)


def test_the_command_is_the_program(tmp_path):
    assert command("--version").stdout.split() == ["dalean", dalean.__version__]
    assert command("--help").returncode == 0
    refused = command("train", "--set", "seed=x")
    assert refused.returncode == 2 and "seed" in refused.stderr
    assert command("verify", tmp_path).returncode == 1
    module = subprocess.run([sys.executable, "-m", "dalean", "--version"], capture_output=True, text=True, check=True)
    assert module.stdout == command("--version").stdout


LONG = {"network.hidden": [512], "learning.epochs": 10_000}


def test_an_interrupt_ends_a_run_within_a_batch(tmp_path):
    # what was started in the background may have been told to hear no interrupt
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heard}; import dalean; dalean.train({LONG!r}, out={str(tmp_path)!r}, progress=False, threads=1)"
    # an interrupt before Python hears it would end it as any program
    child = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    wait_for(lambda: list(tmp_path.glob("*/metrics.jsonl")), child)
    child.send_signal(signal.SIGINT)
    started = time.monotonic()
    _, said = child.communicate(timeout=60)
    assert time.monotonic() - started < 5 and "KeyboardInterrupt" in said
    (folder,) = (path.parent for path in tmp_path.glob("*/config.toml"))
    # what is finished is kept, and the run can go on
    assert dalean.Run(folder).receipt["status"] == "running"


def test_an_interrupt_ends_the_command_with_its_own_code(tmp_path):
    program = os.path.join(os.path.dirname(sys.executable), "dalean")
    child = subprocess.Popen(
        [program, "train", *settings(LONG), "--out", tmp_path, "--quiet"], stderr=subprocess.PIPE, text=True
    )
    wait_for(lambda: list(tmp_path.glob("*/metrics.jsonl")), child)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=60)
    assert child.returncode == 3 and "--resume" in said


def wait_for(there, child):
    until = time.monotonic() + 60
    while not there():
        assert child.poll() is None and time.monotonic() < until
        time.sleep(0.05)
    time.sleep(0.3)


def test_other_threads_go_on_meanwhile(tmp_path, small):
    counted = 0
    over = threading.Event()

    def count():
        nonlocal counted
        while not over.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    dalean.train({**small, "learning.epochs": 3}, out=tmp_path, progress=False)
    over.set()
    thread.join()
    assert counted > 20


def test_a_sweep_is_a_table(tmp_path, small):
    sweep = {
        "base": {**small},
        "axis": [{"name": "bits", "key": "hw.cell.level_bits", "values": [3, 8]}],
        "seeds": [1, 2],
    }
    table = dalean.sweep(sweep, store=tmp_path / "store", name="bits", jobs=2, progress=False)
    assert len(table) == 4 and table.finished == table.runs == 4 and table.failed == 0
    assert sorted(set(table["bits"])) == [3, 8] and set(table["status"]) == {"finished"}
    assert "test_accuracy" in table.columns and table.units["test_accuracy"] == "%"
    assert table.page.exists() and "<table" in table._repr_html_()
    # the same rows, and nothing is run again
    again = dalean.sweep(sweep, store=tmp_path / "store", name="bits", jobs=1, progress=False)
    assert again.rows == table.rows
    # a row is the run that `train` gives
    row = next(row for row in table.rows if row["bits"] == 3 and row["seed"] == 2)
    keys = {key: value for key, value in small.items() if key != "seed"}
    run = dalean.train(keys, {"hw.cell.level_bits": 3}, tmp_path / "runs", seed=2, progress=False)
    assert run.state_hash == row["state_hash"]
    assert table.to_parquet(tmp_path / "t.parquet").read_bytes()[:4] == b"PAR1"
    polars = pytest.importorskip("polars")
    assert polars.read_parquet(tmp_path / "t.parquet").height == table.to_polars().height == 4
    pandas = pytest.importorskip("pandas")
    assert len(table.to_pandas()) == 4
    pytest.importorskip("pyarrow")
    assert isinstance(pandas.DataFrame.from_arrow(table) if hasattr(pandas.DataFrame, "from_arrow") else table.to_pandas(), pandas.DataFrame)
    assert polars.from_arrow(__import__("pyarrow").table(table)).height == 4


def test_keys_are_those_of_the_program():
    keys = command("keys", "--json").stdout
    stubs = os.path.join(os.path.dirname(__file__), "..", "stubs.py")
    made = subprocess.run([sys.executable, stubs], input=keys, capture_output=True, text=True, check=True).stdout
    import dalean.keys

    with open(dalean.keys.__file__, encoding="utf-8") as file:
        assert file.read() == made, "make it again: dalean keys --json | python python/stubs.py > python/dalean/keys.py"


def test_the_quick_start_notebook(examples, tmp_path):
    """In a kernel where there is one; else cell by cell in this process, which finds the same mistakes of ours."""
    path = examples / "quickstart.ipynb"
    try:
        import nbclient
        import nbformat

        import ipykernel  # noqa: F401
    except ImportError:
        cells = json.loads(path.read_text())["cells"]
        names = {"__name__": "__main__"}
        for cell in cells:
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), str(path), "exec"), names)
        return
    nbclient.NotebookClient(nbformat.read(path, 4), timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()


GRID = {
    "base": {"network.hidden": [16], "learning.epochs": 6},
    "axis": [
        {"name": "bits", "key": "hw.cell.level_bits", "values": [3, 8]},
        {"name": "rates", "key": "learning.rate", "values": [12, 18, 24]},
    ],
}


def rows(table):
    """What a table says, but for the times that runs took."""
    columns = {name: list(table[name]) for name in table.columns if "second" not in name}
    return columns


@pytest.fixture(scope="module")
def ray():
    ray = pytest.importorskip("ray")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield ray
    ray.shutdown()


def test_tasks_of_ray_give_the_rows_of_a_plain_sweep(ray):
    plain = dalean.sweep(GRID, store="plain", name="grid")
    shared = dalean.sweep(GRID, store="shared", name="grid", ray=True)
    assert rows(shared) == rows(plain) and len(rows(plain)["bits"]) == 6
    # and again: nothing is left to do
    assert rows(dalean.sweep(GRID, store="shared", name="grid", ray=True)) == rows(plain)


def test_a_worker_that_is_killed_loses_nothing_and_doubles_nothing(ray, tmp_path):
    """Kills workers at five moments; what they did not finish others go on with."""
    grid = {**GRID, "base": {**GRID["base"], "learning.epochs": 60}}
    plain = dalean.sweep(grid, store="plain", name="grid")
    draw, killed = random.Random(5), []
    done = threading.Event()

    def kill():
        while not done.wait(draw.uniform(0.3, 0.9)) and len(killed) < 5:
            if pids := workers(ray):
                pid = draw.choice(pids)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                    killed.append(pid)

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        shared = dalean.sweep(grid, store="shared", name="grid", ray=True)
    finally:
        done.set()
        killer.join()
    assert killed and rows(shared) == rows(plain)
    receipts = list((tmp_path / "shared").rglob("receipt.json"))
    assert len(receipts) == 6
    for run in (dalean.Run(receipt.parent) for receipt in receipts):
        assert [one["epoch"] for one in run.metrics] == list(range(61))


def workers(ray):
    """Processes of Ray, below this test's own, that carry out a run now."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if (place / "cmdline").read_bytes().startswith(b"ray::one"):
                found.append(int(place.name))
    return found
