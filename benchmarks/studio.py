"""Times of the studio in a real browser, beside the bars: `python benchmarks/studio.py [COLUMNS ROWS SIZE]`.

Prints wall seconds, and CPU seconds of the processes, which say more on a machine that others use.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from support.studio import Studio, running_studio

#: seconds, but for those that say what they are: for 4.8 million pixels on two free cores, with compiled kernels
BARS = {
    "command to page": 1.5, "picture seen": 0.3, "classes": 5.0, "noise slider": 1.0, "smoothing": 2.0,
    "mesh there": 3.0, "mesh shown": 1.0, "frame, median ms": 17, "frame, p95 ms": 40, "redraw": 0.4,
    "worst element": 0.5, "redraw, zoomed in": 0.03, "cancel": 0.5, "cancel: worker dead": 0.2,
    "ping, median ms": 10, "ping, most ms": 100, "MB of the server": 80,
    "MB of the fork server": 250, "MB of the worker, peak": 400, "MB of the page's heap": 50,
}  # fmt: skip


def rock(columns: int, rows: int) -> Image.Image:
    """Five phases with noise of the grain."""
    from imgquad_mesh.outputs.rock_picture import rock_labels

    rng = np.random.default_rng(1)
    levels = np.array([60, 95, 130, 165, 200, 20], float)[rock_labels(columns, rows, noise=0.0)]
    return Image.fromarray(np.clip(levels + rng.normal(0, 7, levels.shape), 0, 255).astype(np.uint8))


def memory(pid: int) -> dict[str, float]:
    """MB that a process has and has had at most."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    found = {line.split(":")[0]: float(line.split()[1]) / 1e3 for line in lines if line.startswith("Vm")}
    return {"now": found["VmRSS"], "peak": found["VmHWM"]}


def children(pid: int) -> list[int]:
    try:
        found = " ".join(each.read_text() for each in Path(f"/proc/{pid}/task").glob("*/children"))
    except (FileNotFoundError, ProcessLookupError):
        return []
    return [int(child) for child in found.split()]


def family(pid: int) -> list[int]:
    """A process, its children, and theirs."""
    return [pid, *(each for child in children(pid) for each in family(child))]


def cpu(pid: int) -> float:
    try:
        parts = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return (int(parts[11]) + int(parts[12])) / os.sysconf("SC_CLK_TCK")


class Bench:
    """A page, and the times of what is done on it."""

    def __init__(self, studio: Studio, page: Any) -> None:
        self.studio, self.page = studio, page

    def until(self, expression: str) -> None:
        while not self.page.evaluate(expression):
            time.sleep(0.04)  # asking takes the browser time that the worker wants

    @property
    def workers(self) -> list[int]:
        """The fork server's children."""
        return [each for server in children(self.studio.process.pid) for each in children(server)]

    @property
    def used(self) -> dict[str, float]:
        """CPU seconds so far."""
        browser = set(family(os.getpid())) - set(family(self.studio.process.pid)) - {os.getpid()}
        return {
            "worker": sum(map(cpu, self.workers)),
            "server": cpu(self.studio.process.pid),
            "browser": sum(map(cpu, browser)),
        }

    @contextmanager
    def timing(self, name: str) -> Iterator[None]:
        before, start = self.used, time.perf_counter()
        yield
        wall, used = time.perf_counter() - start, self.used
        self.told(name, wall, "; CPU s: " + ", ".join(f"{who} {used[who] - before[who]:.2f}" for who in used))

    def timed(self, name: str, act: Callable[[], Any], expression: str) -> None:
        with self.timing(name):
            act()
            self.until(expression)

    def told(self, name: str, value: float, more: str = "") -> None:
        print(f"{name:24} {value:8.2f}   bar {BARS[name]:g}{more}", flush=True)


def fresh(stage: str) -> str:
    return f"studio.fresh('{stage}') && !document.body.hasAttribute('data-busy')"


def measure(bench: Bench, picture: Path, size: float) -> None:
    page, studio = bench.page, bench.studio
    bench.timed("picture seen", lambda: page.set_input_files("#file", str(picture)), "studio.view.size[0] > 1")
    with bench.timing("classes"):
        bench.until(fresh("segment"))
    page.click("#step1")
    bench.until(fresh("denoise"))
    slide = "([id, v]) => { const e = document.getElementById(id); e.value = v; e.dispatchEvent(new Event('input')); }"
    page.evaluate(slide, ["min_length", 12])
    bench.until(fresh("denoise"))
    bench.timed("noise slider", lambda: page.evaluate(slide, ["min_pixels", 144]), fresh("denoise"))
    page.evaluate(slide, ["size", size]) if page.locator("#size").count() else None
    bench.timed("smoothing", lambda: page.click("#step2"), fresh("smooth"))
    page.click("#step3")
    page.evaluate(slide, ["size", size])
    time.sleep(0.3)
    ping = []
    with bench.timing("mesh there"):
        if page.locator("#meshnow").is_enabled():  # size is not the default, with which the step began
            page.click("#meshnow")
        while not page.evaluate("Boolean(studio.results.mesh)"):
            asked = time.perf_counter()
            studio.ask("GET", "/icon.svg")
            ping.append(1000 * (time.perf_counter() - asked))
            time.sleep(0.02)
    with bench.timing("mesh shown"):
        bench.until("studio.view.quads && studio.view.asked === undefined")
    print(page.evaluate("studio.results.mesh.quality.n_quads"), "quads")
    bench.told("ping, median ms", statistics.median(ping))
    bench.told("ping, most ms", max(ping))
    cost = "(() => { const s = performance.now(); studio.view.draw(); return (performance.now() - s) / 1000; })()"
    bench.told("redraw", page.evaluate(cost))
    box = page.locator("#canvas").bounding_box()
    page.evaluate(
        "() => { globalThis.ticks = []; let last = performance.now(); const tick = (now) => {"
        " ticks.push(now - last); last = now; if (ticks.length < 400) requestAnimationFrame(tick); };"
        " requestAnimationFrame(tick); }"
    )
    page.mouse.move(box["x"] + 200, box["y"] + 200)
    page.mouse.down()
    for k in range(120):
        page.mouse.move(box["x"] + 200 + 2 * k, box["y"] + 200 + k)
    page.mouse.up()
    ticks = sorted(page.evaluate("ticks.slice(3)"))
    bench.told("frame, median ms", statistics.median(ticks))
    bench.told("frame, p95 ms", ticks[int(0.95 * (len(ticks) - 1))])
    worst = page.locator("#worst button").first
    bench.timed("worst element", worst.click, "Boolean(studio.view.mark)")
    bench.told("redraw, zoomed in", page.evaluate(cost))
    bench.told("MB of the server", memory(studio.process.pid)["now"])
    servers = [pid for pid in children(studio.process.pid) if children(pid)]
    bench.told("MB of the fork server", memory(servers[0])["now"])
    bench.told("MB of the worker, peak", max(memory(pid)["peak"] for pid in bench.workers))
    bench.told("MB of the page's heap", page.evaluate("performance.memory.usedJSHeapSize / 1e6"))
    page.evaluate(slide, ["size", size + 1])
    page.click("#meshnow")
    bench.until("document.getElementById('stage').textContent === 'meshing'")
    working = bench.workers
    start = time.perf_counter()
    page.evaluate("document.getElementById('cancel').click()")
    while set(working) & set(bench.workers):
        time.sleep(0.002)
    bench.told("cancel: worker dead", time.perf_counter() - start)
    page.click("#meshnow")
    bench.until("document.getElementById('stage').textContent === 'meshing'")
    bench.timed("cancel", lambda: page.click("#cancel"), "!document.body.hasAttribute('data-busy')")


def main() -> None:
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, usual in (("columns", 2200), ("rows", 2200), ("size", 4)):
        parser.add_argument(name, nargs="?", type=float, default=usual)
    columns, rows, size = vars(parser.parse_args()).values()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; {columns:g} x {rows:g} pixels, size {size:g}")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        picture = Path(folder) / "rock.png"
        rock(int(columns), int(rows)).save(picture)
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            args=["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--enable-precise-memory-info"],
        )
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(600_000)
        time.sleep(1)  # the browser is there before the command, as a user's is
        start = time.perf_counter()
        with running_studio(Path(folder)) as studio:
            up = time.perf_counter() - start
            page.goto(studio.address)
            page.wait_for_selector("body[data-ready]")
            bench = Bench(studio, page)
            bench.told("command to page", time.perf_counter() - start, f", the command alone {up:.2f}")
            page.click("#rock")  # the fork server is ready when the first worker answers
            bench.until(fresh("segment"))
            page.reload()
            page.wait_for_selector("body[data-ready]")
            measure(bench, picture, size)
            browser.close()


if __name__ == "__main__":
    main()
