"""How evenly a servo runs, against the empty loop of the same period and scheduling beside it (`measure_bare_loop`), which shows the
best that the host can do at that time: so what is judged holds on a loaded machine, too."""
from hosts import eventually


def loops(watch, component):
    """Loops by name, of a component that is up; `watch` keeps component_status by component."""
    return {loop["name"]: loop for loop in (watch.get(component) or {"loops": []})["loops"]}


def slip_shares(before, after):
    """Which share of the periods between two looks the servo and the bare loop skipped."""
    def share(name):
        ticks, slips = (after[name][k] - before[name][k] for k in ("ticks", "slips"))
        return slips / max(1, ticks + slips)
    return share("servo"), share("bare_loop")


def watched_slip_shares(watch, component, seconds, limit_s):
    """The same from now on, for as long as the servo takes for a quarter of the ticks due in `seconds`."""
    eventually(lambda: {"servo", "bare_loop"} <= loops(watch, component).keys(), limit_s, f"the servo of {component} runs")
    before = loops(watch, component)
    due = before["servo"]["ticks"] + seconds / before["servo"]["period_s"] / 4
    eventually(lambda: loops(watch, component)["servo"]["ticks"] > due, limit_s, "the servo goes on")
    return slip_shares(before, loops(watch, component))


def expect_as_bare(what, shares, quiet=0.0):
    """`shares`: of the servo and the bare loop; `quiet`: what the servo skipped before, in peace."""
    servo, bare = shares
    limit = max(quiet, bare) * 1.5 + 0.05
    assert servo <= limit, f"{what} the servo skips {servo:.3f} of its ticks, allowed {limit:.3f}"


def with_bare_loop(source, folder, component):
    """A copy of the component's shipped parameters that runs the bare loop."""
    text = (source / f"components/{component}/{component}.yaml").read_text().replace("measure_bare_loop: false", "measure_bare_loop: true")
    assert "measure_bare_loop: true" in text
    file = folder / f"{component}.yaml"
    file.write_text(text)
    return file
