"""Who has no right to, can neither read nor command a secured site: he is on its network, with this project's own tools."""
import json
import shutil

from hosts import eventually

LISTEN_S = 6  # an admitted spy hears its first sample within two, on a machine that has time for it
RIGHTFUL_S = 120
REFUSED = (1, 2, 3)


def samples(done):
    """Samples that a spy printed."""
    return sum(1 for line in done.stdout.splitlines() if line.startswith("{") and "sample" in json.loads(line))


def listen(wall, topology):
    return wall.site["diagnostics"].try_run(
        *wall.words("dds_spy", "echo", "--json", "--seconds", str(LISTEN_S), topology=topology), limit_s=120)


def command(wall, topology):
    """Tries to move an object; what it answered."""
    pose = "0.4 -0.1 0.301 0 0 30"
    return wall.site["diagnostics"].try_run(
        *wall.words("wva_server", "command", "move", "--object", "pump", "--pose", pose, "--timeout-s", str(LISTEN_S),
                    topology=topology), limit_s=120)


def attempt(wall, name, documents):
    """`documents`: what he has in place of the site's; "none": he does not even try DDS Security."""
    topology = wall.make_topology(f"{name}.yaml", documents)
    heard, commanded = listen(wall, topology), command(wall, topology)
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
COMMANDS = {
    "wva_server_command": ("wva_server", "command", "--timeout-s", LISTEN_S, "move", "--object", "pump", "--pose", "0.4 -0.1 0.301 0 0 60"),
    "phantom_sensing_command": ("phantom_sensing", "command", "--timeout-s", LISTEN_S, "self-test"),
    "dds_recorder_trigger": ("dds_recorder", "trigger", "--by", "an onlooker")}
READ_BY_ONLOOKERS = {"master_state", "slave_state", "drag_field", "percept", "interest_points", "skin_percept", "component_status",
                     "workspace_object"}


def onlookers_only_look(wall):
    """Spy, recorder and session read every topic with their own documents; with these no commanding tool can command anything."""
    diagnostics = wall.site["diagnostics"]
    for name in ONLOOKERS:
        folder = copy_of_site(wall, f"as_{name}")
        for tool in COMMANDS:
            shutil.rmtree(folder / tool)
            shutil.copytree(wall.security / name, folder / tool)
        topology = wall.make_topology(f"as_{name}.yaml", folder)
        for tool, (program, *words) in COMMANDS.items():
            done = diagnostics.try_run(*wall.words(program, *words, topology=topology), limit_s=120)
            assert done.returncode in REFUSED, f"{name} commanded as {tool}: {done.stdout}"
            print(f"  {name} as {tool}: {(done.stderr or done.stdout).strip().splitlines()[-1][:110]}")
    heard, recorded = set(), set()

    def all_heard():
        done = diagnostics.try_run(*wall.words("dds_spy", "hz", "--json", "--history", "--seconds", str(LISTEN_S)), limit_s=120)
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
    before = version(wall, watch)
    wall.make_security(wall.folder / "rogue")
    attempt(wall, "no_documents", "none")
    attempt(wall, "rogue_authority", wall.folder / "rogue")
    attempt(wall, "wrong_permissions", swapped(wall))
    attempt(wall, "forged_permissions", forged(wall))
    attempt(wall, "edited_permissions", edited(wall))
    assert version(wall, watch) == before, "somebody changed the workspace"
    # The same tools with their own documents are heard: what was refused above was refused for its documents.
    heard = eventually(lambda: samples(listen(wall, wall.topology)), RIGHTFUL_S, "the rightful spy reads samples")
    eventually(lambda: command(wall, wall.topology).returncode == 0, RIGHTFUL_S, "the rightful command is carried out")
    eventually(lambda: version(wall, watch) > before, RIGHTFUL_S, "the rightful command changes the workspace")
    print(f"  rightful: reads {heard} samples, moves an object")
