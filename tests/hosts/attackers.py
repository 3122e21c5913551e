"""Who has no right to, can neither read nor command a secured site: he is on its network, with this project's own tools."""
import json
import shutil
from concurrent.futures import ThreadPoolExecutor

from hosts import eventually

# How long the rightful try, until they succeed; a loaded machine needs more. Attackers then have as long.
PATIENCE_S = (6, 12, 24, 48, 96)
REFUSED = (1, 2, 3)


def samples(done):
    """Samples that a spy printed."""
    return sum(1 for line in done.stdout.splitlines() if line.startswith("{") and "sample" in json.loads(line))


def listen(wall, topology, seconds):
    return wall.site["diagnostics"].try_run(
        *wall.words("dds_spy", "echo", "--json", "--seconds", str(seconds), topology=topology), limit_s=120 + seconds)


def command(wall, topology, seconds):
    """Tries to move an object; what it answered."""
    pose = "0.4 -0.1 0.301 0 0 30"
    return wall.site["diagnostics"].try_run(
        *wall.words("wva_server", "command", "move", "--object", "pump", "--pose", pose, "--timeout-s", str(seconds),
                    topology=topology), limit_s=120 + seconds)


def listen_and_command(wall, topology, seconds):
    """Both at the same time."""
    with ThreadPoolExecutor() as pool:
        return [done.result() for done in [pool.submit(what, wall, topology, seconds) for what in (listen, command)]]


def rightful(wall):
    """The tools with their own documents are heard and obeyed, so that who is not is refused for his documents. How long that takes here."""
    for seconds in PATIENCE_S:
        heard, commanded = listen_and_command(wall, wall.topology, seconds)
        if samples(heard) and commanded.returncode == 0:
            print(f"  rightful: reads {samples(heard)} samples, moves an object; all others have {seconds} s, too")
            return seconds
    raise AssertionError(f"the rightful read {samples(heard)} samples and were answered ({commanded.returncode}): {commanded.stdout}{commanded.stderr}")


def attempt(wall, name, documents, seconds):
    """`documents`: what he has in place of the site's; "none": he does not even try DDS Security."""
    topology = wall.make_topology(f"{name}.yaml", documents)
    heard, commanded = listen_and_command(wall, topology, seconds)
    assert samples(heard) == 0, f"{name} read {samples(heard)} samples"
    assert commanded.returncode in REFUSED, f"{name} commanded: {commanded.stdout}"
    print(f"  {name}: reads nothing ({heard.returncode}), commands nothing "
          f"({commanded.returncode}: {(commanded.stderr or commanded.stdout).strip().splitlines()[-1][:120]})")


def copy_of_site(wall, name):
    folder = wall.folder / name
    shutil.copytree(wall.security, folder)
    return folder


def swapped(wall):
    """Right certificates, of this site, with the wrong permissions: the spy's tool has the commander's documents and vice versa."""
    folder = copy_of_site(wall, "swapped")
    shutil.rmtree(folder / "dds_spy")
    shutil.rmtree(folder / "wva_server_command")
    shutil.copytree(wall.security / "phantom_sensing_command", folder / "dds_spy")
    shutil.copytree(wall.security / "dds_spy", folder / "wva_server_command")
    return folder


def forged(wall):
    """Right certificates; permissions of another site's authority, which grant everything."""
    folder = copy_of_site(wall, "forged")
    for name in ("dds_spy", "wva_server_command"):
        shutil.copy(wall.folder / "rogue" / name / "permissions.p7s", folder / name / "permissions.p7s")
    return folder


def edited(wall):
    """Right certificates; signed permissions, edited afterwards."""
    folder = copy_of_site(wall, "edited")
    for name in ("dds_spy", "wva_server_command"):
        file = folder / name / "permissions.p7s"
        text = file.read_bytes()
        assert b"<default>DENY</default>" in text
        file.write_bytes(text.replace(b"<default>DENY</default>", b"<default>ALLOW</default>"))
    return folder


def version(wall, watch):
    status = watch.get("wva_server")
    return next(f["value"] for f in status["figures"] if f["name"] == "version")


ONLOOKERS = ("dds_spy", "dds_recorder", "phantom_session")
READ_BY_ONLOOKERS = {"master_state", "slave_state", "drag_field", "percept", "interest_points", "skin_percept", "component_status",
                     "workspace_object"}


def commands(seconds):
    """What each commanding tool is tried with."""
    pose = "0.4 -0.1 0.301 0 0 60"
    return {"wva_server_command": ("wva_server", "command", "move", "--object", "pump", "--pose", pose, "--timeout-s", seconds),
            "phantom_sensing_command": ("phantom_sensing", "command", "self-test", "--timeout-s", seconds),
            "dds_recorder_trigger": ("dds_recorder", "trigger", "--by", "an onlooker")}


def onlookers_only_look(wall, seconds):
    """Spy, recorder and session read every topic with their own documents; with these no commanding tool can command anything."""
    diagnostics = wall.site["diagnostics"]
    for name in ONLOOKERS:
        folder = copy_of_site(wall, f"as_{name}")
        for tool in commands(seconds):
            shutil.rmtree(folder / tool)
            shutil.copytree(wall.security / name, folder / tool)
        topology = wall.make_topology(f"as_{name}.yaml", folder)
        with ThreadPoolExecutor() as pool:
            tries = {tool: pool.submit(diagnostics.try_run, *wall.words(program, *words, topology=topology), limit_s=120 + seconds)
                     for tool, (program, *words) in commands(seconds).items()}
        for tool, tried in tries.items():
            done = tried.result()
            assert done.returncode in REFUSED, f"{name} commanded as {tool}: {done.stdout}"
            print(f"  {name} as {tool}: {(done.stderr or done.stdout).strip().splitlines()[-1][:110]}")
    heard, recorded = set(), set()

    def all_heard():
        done = diagnostics.try_run(*wall.words("dds_spy", "hz", "--json", "--history", "--seconds", str(seconds)), limit_s=120 + seconds)
        for line in done.stdout.splitlines():  # Fast DDS itself writes its errors there
            if line.startswith("{"):
                heard.update(stream["topic"] for stream in json.loads(line)["streams"] if stream["samples"])
            else:
                print(f"  beside its report the spy says: {line}")
        done = diagnostics.try_run(wall.bin / "dds_recorder", "info", "--json", wall.folder / "recordings", limit_s=120)
        recorded.update(t for file in json.loads(done.stdout) for t, what in file["topics"].items() if what["samples"])
        return READ_BY_ONLOOKERS <= heard & recorded
    eventually(all_heard, 120, f"spy and recorder hear {sorted(READ_BY_ONLOOKERS)}")
    print(f"  the spy hears {len(heard)} topics, the recorder {len(recorded)}")


def attackers_fail(wall, watch):
    """Also returns how long the rightful took (s)."""
    before = version(wall, watch)
    seconds = rightful(wall)
    moved = eventually(lambda: max(version(wall, watch) - before, 0), 120, "the rightful command changes the workspace") + before
    wall.make_security(wall.folder / "rogue")
    attempt(wall, "no_documents", "none", seconds)
    attempt(wall, "rogue_authority", wall.folder / "rogue", seconds)
    attempt(wall, "wrong_permissions", swapped(wall), seconds)
    attempt(wall, "forged_permissions", forged(wall), seconds)
    attempt(wall, "edited_permissions", edited(wall), seconds)
    assert version(wall, watch) == moved, "somebody changed the workspace"
    return seconds
