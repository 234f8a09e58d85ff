# SPDX-License-Identifier: BSD-3-Clause
"""Runs public clients of the Magician against the emulator, each in an environment of its own.

python3 src/fabric_dobot_driver/conformance [CLIENT ...] [--json FILE]
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).resolve().parent
ENVIRONMENTS = HERE.parents[2] / "build" / "conformance"
CLIENTS = tuple(sorted(path.stem[4:] for path in HERE.glob("run_*.py")))
SPEED = 4.0  # seconds of the arm in one real second
HOME_TIME = 8.0  # s of the arm
TIME_LIMIT = 120.0  # s for a client: one of them waits for answers without end

sys.path.insert(0, str(HERE))
from session import STEPS  # noqa: E402


def environment(client: str) -> Path:
    """Python of the client's environment, which is made the first time."""
    wanted = (HERE / f"requirements-{client}.txt").read_text(encoding="utf-8")
    folder = ENVIRONMENTS / client
    stamp = folder / "requirements"
    python = folder / "bin" / "python3"
    if not (stamp.exists() and stamp.read_text(encoding="utf-8") == wanted):
        base = Path(sys.base_prefix) / "bin" / "python3"
        subprocess.run([base, "-m", "venv", "--clear", folder], check=True)
        pip = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
        requirements = HERE / f"requirements-{client}.txt"
        subprocess.run([*pip, "-r", requirements], check=True, stdout=sys.stderr)
        stamp.write_text(wanted, encoding="utf-8")
    return python


@contextmanager
def emulator(link: Path) -> Iterator[None]:
    """An emulator at this link."""
    command = [sys.executable, "-m", "fabric_dobot_driver.emulator", "--link", link]
    options = ["--speed", SPEED, "--home-time", HOME_TIME, "--log", link.with_suffix(".log")]
    words = [str(word) for word in (*command, *options)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            process.stdout.readline()
            yield
        finally:
            process.terminate()


def run(client: str) -> list[dict]:
    """What the client's script wrote down: step, seconds, fault."""
    python = environment(client)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        results, link = folder / "results", folder / "arm"
        results.touch()
        with emulator(link):
            script = [python, HERE / f"run_{client}.py", link, results]
            fault = _carry_out(script)
        entries = [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()]
    if fault is not None and not any(entry["fault"] for entry in entries):
        step = STEPS[len(entries)] if len(entries) < len(STEPS) else STEPS[-1]
        entries.append({"step": step, "seconds": 0.0, "fault": fault})
    return entries


def _carry_out(script: list) -> str | None:
    try:
        told = subprocess.run(
            script, timeout=TIME_LIMIT, capture_output=True, text=True, check=False
        )
    except subprocess.TimeoutExpired:
        return f"not done within {TIME_LIMIT:g} s"
    lines = told.stderr.strip().splitlines()
    return (lines[-1] if lines else f"ended with {told.returncode}") if told.returncode else None


def passed(entries: list[dict]) -> bool:
    """True when every step was done without a fault."""
    done = [entry["step"] for entry in entries if entry["fault"] is None]
    return done == list(STEPS)


def table(results: dict[str, list[dict]]) -> str:
    """Clients by steps, in s, as Markdown; faults below."""
    rows = [("client", *STEPS, "total"), ("---",) * (len(STEPS) + 2)]
    faults = []
    for client, entries in results.items():
        by_step = {entry["step"]: entry for entry in entries}
        cells = []
        for step in STEPS:
            entry = by_step.get(step)
            if entry is None:
                cells.append("-")
            elif entry["fault"] is None:
                cells.append(f"{entry['seconds']:.2f}")
            else:
                cells.append("FAILED")
                faults.append(f"{client}, {step}: {entry['fault']}")
        rows.append((client, *cells, f"{sum(entry['seconds'] for entry in entries):.1f}"))
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines + faults)


def main(words: list[str] | None = None) -> int:
    """The exit code: 0 when every client did every step."""
    parser = argparse.ArgumentParser(description="Public clients against the emulator.")
    parser.add_argument("clients", nargs="*", metavar="CLIENT", help=f"of {', '.join(CLIENTS)}")
    parser.add_argument("--json", type=Path, metavar="FILE", help="writes the results there, too")
    args = parser.parse_args(words)
    unknown = set(args.clients) - set(CLIENTS)
    if unknown:
        parser.error(f"no client {sorted(unknown)[0]!r}; there are: {', '.join(CLIENTS)}")
    clients = args.clients or CLIENTS
    with ThreadPoolExecutor(len(clients)) as pool:
        results = dict(zip(clients, pool.map(run, clients), strict=True))
    print(table(results))
    if args.json is not None:
        args.json.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    return 0 if all(map(passed, results.values())) else 1


if __name__ == "__main__":
    sys.exit(main())
