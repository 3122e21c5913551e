"""What happens to the system, and when: a pure function of a seed. The same seed gives the same steps, whoever carries them out.

A step is one story: {"number", "kind", "pause_s": calm before it, "actions": [{"at_s", "do", …}], "lasts_s"}. Its actions are in order of
`at_s`, counted from the step's beginning; what they began they end, so that a step leaves nothing behind but what the system must recover
from by itself. The next step begins once the system has recovered.
"""
import random

SIDES = ("master_io", "slave_io")
DRIVES = ("master_drives_a", "master_drives_b", "slave_drives_a", "slave_drives_b")
OTHERS = ("wva_server", "phantom_sensing", "audio_percept", "synthetic_viewer")
PROCESSES = SIDES + OTHERS
# Threads by their names (docs/threads.md). "main" is the thread that has the executable's name.
THREADS = {"master_io": ("servo", "publisher", "receiver", "dds", "main", "output"), "slave_io": ("servo", "publisher", "receiver", "dds", "main", "output"),
           "phantom_sensing": ("sensing", "receiver", "workspace", "alerts", "main"), "wva_server": ("receiver", "main"),
           "audio_percept": ("audio", "main"), "synthetic_viewer": ("viewer", "main", "receiver")}
HOSTS = ("slave", "view")  # those at the end of a cable
LEASE_S = 5.0
LIES = ("encoder_stuck", "encoder_mirrored", "encoder_jump", "speed_negated", "speed_garbage")  # of simulated_drive --fault
LIES_AFTER_S = 7.0  # until then the sides are coupled again


def action(at_s, do, **what):
    return {"at_s": round(at_s, 3), "do": do, **what}


def during(chance, begin_s, lasts_s, do, undo, **what):
    return [action(begin_s, do, **what), action(begin_s + lasts_s, undo, **what)]


def killed(process, at_s, back_s):
    return [action(at_s, "kill", process=process), action(at_s + back_s, "start", process=process)]


def kill(chance):
    victims = chance.sample(PROCESSES, chance.choice((1, 1, 2))) if chance.random() < 0.4 else [chance.choice(SIDES)]
    actions = []
    for victim in victims:
        at_s = chance.uniform(0.0, 0.6)
        for _ in range(chance.choice((0, 0, 1, 2))):  # again, while it starts
            back_s = chance.choice((0.0, 0.2))
            actions += killed(victim, at_s, back_s)
            at_s += back_s + chance.uniform(0.05, 0.6)
        actions += killed(victim, at_s, chance.choice((0.0, 0.2, 1.5)))
    return actions


def freeze(chance):
    actions = []
    for victim in chance.sample(PROCESSES, 1) if chance.random() < 0.5 else chance.sample(SIDES, chance.choice((1, 1, 2))):
        actions += during(chance, chance.uniform(0.0, 0.5), chance.choice((0.1, 0.3, 0.8, LEASE_S + 2.0)), "freeze", "thaw", process=victim)
    return actions


def freeze_thread(chance):
    process = chance.choice(SIDES + SIDES + tuple(THREADS))
    return during(chance, 0.0, chance.choice((0.2, 0.7, 1.5, 3.0)), "freeze_thread", "thaw_thread", process=process,
                  thread=chance.choice(THREADS[process]))


def network(chance):
    """Loss, delay, jitter and repetition, singly or together; delays on both sides of the round trip's limit of 0.15 s."""
    link = {"loss": 0.0, "delay_ms": 0.0, "jitter_ms": 0.0, "repeated": 0.0}
    for name in chance.sample(("loss", "delay_ms", "repeated"), chance.choice((1, 2, 3))):
        link[name] = {"loss": chance.choice((0.05, 0.2, 0.5)), "delay_ms": chance.choice((10.0, 40.0, 70.0, 100.0, 150.0)),
                      "repeated": chance.choice((0.05, 0.3, 1.0))}[name]
    link["jitter_ms"] = link["delay_ms"] * chance.choice((0.0, 0.3, 0.8))
    host = chance.choice(("slave", "slave", "slave", "view"))
    return [action(0.0, "link", host=host, **link), action(chance.uniform(2.0, 5.0), "link", host=host, loss=0.0, delay_ms=0.0, jitter_ms=0.0, repeated=0.0)]


def partition(chance):
    host = chance.choice(("slave", "slave", "slave", "view"))
    return during(chance, 0.0, chance.choice((0.1, 0.3, 1.0, 3.0, LEASE_S + 2.0)), "cut", "heal", host=host, way=chance.choice(("", "", "to", "from")))


def clock(chance):
    host = chance.choice(("master", "slave"))
    actions, at_s = [], 0.0
    for _ in range(chance.choice((1, 2))):
        actions.append(action(at_s, "clock", host=host, offset_s=chance.choice((-1, 1)) * chance.choice((0.05, 0.5, 5.0, 3600.0))))
        at_s += chance.uniform(1.0, 2.5)
    return actions + [action(at_s, "clock", host=host, offset_s=0.0)]


def full_disk(chance):
    host = chance.choice(("master", "slave"))
    actions = during(chance, 0.0, chance.uniform(3.0, 5.0), "fill_disk", "free_disk", host=host)
    victim = {"master": "master_io", "slave": "slave_io"}[host]
    extra = chance.choice(("nothing", "stop", "kill", "stop and kill"))
    if "stop" in extra:
        actions.append(action(0.5, "stop", how="command"))
    if "kill" in extra:
        actions += killed(victim, 1.2, 0.2)
    return actions


def blocked_log(chance):
    process = chance.choice(SIDES + PROCESSES)
    actions = during(chance, 0.0, chance.uniform(2.0, 5.0), "block_log", "free_log", process=process)
    if chance.random() < 0.5:
        actions.append(action(0.5, "stop", how=chance.choice(("command", "signal_master", "signal_slave"))))
    return actions


def second_writer(chance):
    component = chance.choice(SIDES)
    actions = during(chance, 0.0, chance.uniform(4.0, 6.0), "start_intruder", "end_intruder", component=component)
    if chance.random() < 0.3:  # the first one goes while the second is there
        actions += killed(component, 3.0, 0.5)
    return actions


def stop(chance):
    """A stop, and what could lose it or end it wrongly: deaths, cuts, resets that name other stops, another stop just before a reset."""
    how = chance.choice(("command", "command", "signal_master", "signal_slave"))
    actions = [action(0.3, "stop", how=how)]
    story = chance.choice(("held", "killed", "both_killed", "frozen", "cut_before", "cut_after", "old_reset", "stop_again", "reset_race"))
    if story == "killed":
        actions += killed(chance.choice(SIDES), chance.choice((0.31, 0.35, 1.0)), chance.choice((0.0, 0.5)))
    if story == "both_killed":
        for side in SIDES:
            actions += killed(side, chance.uniform(0.6, 1.0), chance.choice((0.0, 0.5)))
    if story == "frozen":
        actions += during(chance, 0.0, chance.choice((1.0, LEASE_S + 2.0)), "freeze", "thaw", process=chance.choice(SIDES))
    if story == "cut_before":
        actions += during(chance, 0.0, chance.choice((1.5, LEASE_S + 2.0)), "cut", "heal", host="slave", way=chance.choice(("", "to", "from")))
    if story == "cut_after":
        actions += during(chance, 0.8, chance.choice((0.5, 2.0)), "cut", "heal", host="slave", way="")
    if story == "old_reset":
        actions += [action(1.0, "reset", names="old"), action(1.4, "reset", names="other_side"), action(1.8, "reset", names="nothing")]
    if story == "stop_again":  # a reset that was meant for the first stop comes after the second
        actions += [action(1.0, "look"), action(1.2, "stop", how="command"), action(1.6, "reset", names="looked")]
    if story == "reset_race":
        actions += [action(1.0, "reset", names="now"), action(1.0 + chance.choice((0.0, 0.01, 0.05)), "stop", how=chance.choice(("command", "signal_slave")))]
    actions.append(action(actions[-1]["at_s"] + 1.5, "look"))
    return actions


def commands(chance):
    actions, at_s = [], 0.0
    for _ in range(chance.choice((3, 6))):
        name, values = chance.choice((("law", (0, 1, 1, 3)), ("percept", (0, 1)), ("percept_gain", (0, 5, 40, 1000, -1)), ("feedback_gain", (0, 0.001, 10)),
                                      ("percept_gain", (0, 40))))
        actions.append(action(at_s, "set", name=name, value=chance.choice(values)))
        at_s += chance.uniform(0.2, 1.2)
    return actions + [action(at_s, "set", name=name, value=value) for name, value in (("percept", 1), ("percept_gain", 20), ("law", chance.choice((0, 3, 3, 1))))]


def held_up(chance):
    """A servo that its host holds up again and again, as without real-time priority, whatever priority it has here; in between it makes some ticks."""
    process, gap_ms, run_ms, count = chance.choice(SIDES + ("slave_io",)), chance.choice((20, 30, 50, 80)), chance.choice((5, 9, 30)), chance.choice((3, 10, 25))
    lasts_s = count * (gap_ms + run_ms) / 1000 + 0.2
    return during(chance, 0.3, lasts_s, "hold_up", "hold_up_over", process=process, gap_ms=gap_ms, run_ms=run_ms, count=count)


def load(chance):
    return during(chance, 0.0, chance.uniform(3.0, 6.0), "start_load", "end_load", processes=chance.choice((2, 4)), nice=chance.choice((0, 5, -5))) + held_up(chance)


def drives(chance):
    victim = chance.choice(DRIVES)
    if chance.random() < 0.5:
        return killed(victim, 0.0, chance.choice((0.2, 1.0)))
    return during(chance, 0.0, chance.choice((0.1, 0.3, 2.0)), "freeze", "thaw", process=victim)


def lying_drive(chance):
    """A drive of either arm begins to report a false motion once the arms are coupled again (its process is restarted for that)."""
    process = chance.choice(DRIVES)
    # Their revolute joints: the first node of the buses a is the gantry's.
    node = chance.choice((2, 3, 4) if process.endswith("_a") else (1, 2, 3))
    begin = [action(0.0, "start_lying", process=process, node=node, lie=chance.choice(LIES), after_s=LIES_AFTER_S)]
    resets = [action(at_s, "reset", names="now") for at_s in (2.0, 3.0, 4.0, 5.0)]
    return begin + resets + [action(LIES_AFTER_S + chance.uniform(2.5, 4.0), "end_lying", process=process)]


def other_arm(chance):
    """The slave's host has another model of the arm, as after an update of one host alone."""
    return during(chance, 0.0, chance.uniform(5.0, 7.0), "start_other_arm", "end_other_arm", component="slave_io")


def fragments(chance):
    """Fragments of IP packets are lost, as by many firewalls and tunnels."""
    return during(chance, 0.0, chance.choice((1.0, 3.0, LEASE_S + 2.0)), "lose_fragments", "pass_fragments", host=chance.choice(HOSTS))


def lost_files(chance):
    """A stop is in force, and the file that keeps it is lost or spoiled: while the sides run, who write it again, or while both are dead."""
    actions, host = [action(0.3, "stop", how="command")], chance.choice(("master", "slave"))
    alive = chance.random() < 0.5
    how = chance.choice(("removed", "copied", "emptied", "zeroed") if alive else ("emptied", "cut", "zeroed"))
    actions.append(action(1.4, "spoil_files", host=host, how=how))
    for side in SIDES:
        actions += killed(side, 3.5 if alive else 1.0, 0.2 if alive else 1.0)
    return actions + [action(6.0, "look")]


KINDS = {make.__name__: make for make in (
    kill, freeze, freeze_thread, network, partition, clock, full_disk, blocked_log, second_writer, stop, commands, load, drives,
    lying_drive, other_arm, fragments, lost_files)}
# Of some kinds there are more stories than of others.
WEIGHTS = {"stop": 3, "kill": 2, "partition": 2, "freeze": 2}


def step(number, kind, chance):
    """One step; a tenth of all come with load, and a tenth with a bad link."""
    actions = KINDS[kind](chance)
    lasts_s = max(a["at_s"] for a in actions)
    extra = chance.random()
    if kind not in ("load", "network") and extra < 0.2:
        other = load(chance)[:2] if extra < 0.1 else network(chance)
        actions += [dict(a, at_s=0.0 if i == 0 else max(lasts_s, 1.0)) for i, a in enumerate(other)]
    actions.sort(key=lambda a: a["at_s"])
    return {"number": number, "kind": kind, "pause_s": round(chance.uniform(0.5, 2.0), 3), "actions": actions, "lasts_s": max(a["at_s"] for a in actions)}


def steps(seed, only=()):
    """Endless. Every kind comes up once, in an order of its own, before any comes up again (but those that have more to tell)."""
    unknown = set(only) - set(KINDS)
    if unknown:
        raise ValueError(f"no such kind: {', '.join(sorted(unknown))}; allowed: {', '.join(KINDS)}")
    chance = random.Random(seed)
    number = 0
    while True:
        deck = [kind for kind in (only or KINDS) for _ in range(WEIGHTS.get(kind, 1))]
        chance.shuffle(deck)
        for kind in deck:
            number += 1
            yield step(number, kind, random.Random(f"{seed}/{number}/{kind}"))
