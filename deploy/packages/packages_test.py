#!/usr/bin/env python3
"""The Debian packages, built by CPack: each holds its own and nothing else's, depends on what it needs, and its units hold.

packages_test.py BUILD_FOLDER VERSION COMPONENT …
"""
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

BUILD, VERSION, COMPONENTS = Path(sys.argv[1]).resolve(), sys.argv[2], sys.argv[3:]
SERVICES = {"wva_server", "slave_io", "phantom_sensing", "master_io", "audio_percept", "synthetic_viewer", "dds_recorder", "ros2_gateway",
            "workspace_camera"}


def run(*words, **more):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, **more)
    assert done.returncode == 0, f"{words}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout


def name_of(component):
    return "phantom-" + re.sub("^phantom_", "", component).replace("_", "-")


def field(deb, name):
    return run("dpkg-deb", "-f", deb, name).strip()


def check_package(deb, component, files):
    unit = f"/usr/lib/systemd/system/{name_of(component)}.service"
    assert f"/usr/bin/{component}" in files, f"{deb.name}: no executable"
    assert (unit in files) == (component in SERVICES), f"{deb.name}: unit {unit}"
    copyright = f"/usr/share/doc/{name_of(component)}/copyright"
    stray = [f for f in files if component not in f and f not in (unit, copyright) and not f.endswith("/report.gp")]
    assert not stray, f"{deb.name} holds {stray}"
    depends = field(deb, "Depends")
    assert f"phantom-common (= {VERSION})" in depends, depends
    if component != "simulated_drive":
        assert re.search("libfast(rtps|dds)[0-9]", depends), f"{deb.name}: {depends}"
    # The page's TLS; and every participant reads when its documents of DDS Security end.
    assert ("libssl3" in depends) == ("libfastrtps" in depends or "libfastdds" in depends), f"{deb.name}: {depends}"
    assert "libgtest" not in depends and "-dev" not in depends, depends
    assert "libassimp" not in depends, f"{deb.name} links what only the importer may: {depends}"


def check_common(deb, files):
    depends = field(deb, "Depends")
    assert "libassimp" in depends and "python3-yaml" in depends, depends
    for wanted in ("share/phantom/deploy/qos/phantom.xml", "share/phantom/deploy/cells/hot_cell/cell.yaml",
                   "share/phantom/deploy/topologies/shield_wall.yaml", "share/phantom/deploy/topology.yaml", "share/phantom/scripts/topology_file.py",
                   "share/phantom/deploy/security/make",
                   "share/phantom/deploy/security/rights", "share/phantom/idl/types.idl", "share/phantom/idl/topics.md", "bin/phantom-doctor",
                   "libexec/phantom/phantom_mesh_import",
                   "share/phantom/examples/default", "share/phantom/examples/80-phantom-can.network", "share/phantom/examples/80-phantom-can.link",
                   "share/phantom/examples/can-restart.conf", "lib/systemd/system/phantom.target",
                   "lib/systemd/system/phantom-discovery.service", "lib/sysusers.d/phantom.conf"):
        assert "/usr/" + wanted in files, f"phantom-common lacks {wanted}"


def check_haptic_device(deb, files, root, folder):
    """What a maker of devices gets is enough to build and start his process: plain C, by pkg-config."""
    lib = next(f for f in files if f.endswith("/libphantom_haptic_device.so"))
    assert {"/usr/bin/haptic_device_example", "/usr/include/phantom_haptic_device.h", "/usr/share/phantom/doc/haptic_device.md",
            "/usr/share/phantom/examples/haptic_device/haptic_device_example.c"} <= files, sorted(files)
    depends = field(deb, "Depends")
    assert f"phantom-common (= {VERSION})" in depends and re.search("libfast(rtps|dds)[0-9]", depends), depends
    seen = run("nm", "-D", "--defined-only", root / lib.lstrip("/"))
    names = {line.split()[-1] for line in seen.splitlines()}
    assert {n for n in names if "phantom" in n} == {f"phantom_haptic_device_{n}" for n in ("open", "receive", "send", "why", "close")}, names
    pkg_config = root / Path(lib.lstrip("/")).parent / "pkgconfig"
    flags = run("pkg-config", "--cflags", "--libs", "phantom-haptic-device",
                env={**os.environ, "PKG_CONFIG_PATH": str(pkg_config), "PKG_CONFIG_ALLOW_SYSTEM_CFLAGS": "1", "PKG_CONFIG_ALLOW_SYSTEM_LIBS": "1"}).split()
    mine = folder / "my_device"
    run("cc", "-std=c99", "-pedantic-errors", "-Wall", "-Wextra", "-Werror", root / "usr/share/phantom/examples/haptic_device/haptic_device_example.c",
        *flags, "-lm", "-o", mine)
    done = subprocess.run([mine, "--deployment", "/nowhere.yaml"], capture_output=True, text=True,
                          env={**os.environ, "LD_LIBRARY_PATH": str((root / lib.lstrip("/")).parent)})
    assert done.returncode == 2 and "/nowhere.yaml" in done.stderr, done


def check_bill(whole):
    """The bill of materials: sound SPDX 2.3 that names every executable, with its hash, and every library that one links."""
    bill = json.loads((whole / "usr/share/doc/phantom-common/phantom.spdx.json").read_text())
    assert bill["spdxVersion"] == "SPDX-2.3" and bill["dataLicense"] == "CC0-1.0" and bill["SPDXID"] == "SPDXRef-DOCUMENT"
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", bill["creationInfo"]["created"]) and bill["creationInfo"]["creators"]
    assert re.match(r"urn:uuid:[0-9a-f-]{36}$", bill["documentNamespace"]) and bill["name"] == f"phantom-{VERSION}"
    packages = {p["SPDXID"]: p for p in bill["packages"]}
    files = {f["SPDXID"]: f for f in bill["files"]}
    ids = [*packages, *files, "SPDXRef-DOCUMENT"]
    assert len(set(ids)) == len(bill["packages"]) + len(bill["files"]) + 1 and all(re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", i) for i in ids)
    for p in packages.values():
        assert p["name"] and p["versionInfo"] and p["downloadLocation"] and p["filesAnalyzed"] is False, p
        assert re.fullmatch(r"NOASSERTION|[A-Za-z0-9.+-]+( (AND|OR) [A-Za-z0-9.+-]+)*", p["licenseDeclared"]), p
        assert p["licenseDeclared"] != "NOASSERTION" or p["licenseComments"], f"{p['name']}: no licence, and not why"
    links = {}
    for r in bill["relationships"]:
        assert r["spdxElementId"] in ids and r["relatedSpdxElement"] in ids, r
        if r["relationshipType"] == "DYNAMIC_LINK":
            links.setdefault(r["spdxElementId"], set()).add(r["relatedSpdxElement"])
    named = {f["fileName"]: i for i, f in files.items()}
    executables = [f for f in (whole / "usr").rglob("*") if f.is_file() and not f.is_symlink() and f.read_bytes()[:4] == b"\x7fELF"]
    assert {"./" + str(f.relative_to(whole)) for f in executables} == set(named), sorted(named)
    for file in executables:
        ident = named["./" + str(file.relative_to(whole))]
        sums = {c["algorithm"]: c["checksumValue"] for c in files[ident]["checksums"]}
        assert sums["SHA256"] == hashlib.sha256(file.read_bytes()).hexdigest(), f"{file.name}: another file than the bill names"
        linked = {name for package in links[ident] for name in packages[package]["comment"].split()}
        needed = set(re.findall(r"\(NEEDED\).*\[(.+?)\]", run("readelf", "-d", file))) - {other.name for other in executables}
        assert needed <= linked, f"{file.name} links {needed - linked}, which the bill does not say"
        # What is loaded with these, too: following the links from package to package leads to all of it.
        reached, todo = set(), [ident]
        while todo:
            for package in links.get(todo.pop(), ()):
                if package not in reached:
                    reached.add(package)
                    todo.append(package)
        loaded = set(re.findall(r"^\s*(\S+) => /", run("ldd", file), re.M))
        known = {name for package in reached for name in packages[package]["comment"].split()}
        assert loaded <= known, f"{file.name} loads {loaded - known}, which the bill does not say"
    names = {p["name"] for p in packages.values()}
    inputs = {"libeigen3-dev", "libcli11-dev", "nlohmann-json3-dev", "libcpp-httplib-dev", "libhwy-dev", "libspdlog-dev"}
    assert inputs <= names, f"header-only libraries are not in the bill: {inputs - names}"
    assert any(re.fullmatch(r"libstdc\+\+-\d+-dev", n) for n in names), "the C++ library is not in the bill"
    assert {"python3", "openssl", "libegl1"} <= names, "what packages depend on is not in the bill"
    if "PHANTOM_BROWSER_SCENE:BOOL=ON" in (BUILD / "CMakeCache.txt").read_text():
        assert "three" in names, "what the operator's page is bundled with is not in the bill"
        assert "three.js authors" in (whole / "usr/share/doc/phantom-synthetic-viewer/copyright").read_text()
    assert not {n for n in names if "gtest" in n or "benchmark" in n}, "what only tests use is in the bill"
    return f"{len(files)} executables and {len(packages) - 1} packages in the bill of materials"


def check_units(root):
    """systemd's own checker, on the packages' files alone; and what it does not check."""
    units = sorted((root / "usr/lib/systemd/system").glob("phantom*"))
    assert len(units) == len(SERVICES) + 2, units
    for unit in units:
        text = unit.read_text()
        # systemd's own groups of system calls begin with the sign, too: @system-service.
        if unit.name == "phantom-synthetic-viewer.service":
            assert re.search(r"^ExecStart=.* --page-secrets /etc/phantom/page( |$)", text, re.M), "the page is served without its roles"
        left = re.findall(r"@\w*[A-Z]\w*@", text)
        assert not left, f"{unit.name}: {', '.join(left)} was not filled in"
        for program in re.findall(r"^ExecStart=(\S+)", text, re.M):
            here = root / program.lstrip("/")
            assert here.exists() or program == "/usr/bin/fast-discovery-server", f"{unit.name}: {program} is in no package"
    if shutil.which("systemd-analyze") is None:
        return "without systemd-analyze"
    # It looks for executables and documentation below the root that it is given.
    for of_others in ("usr/bin/fast-discovery-server", "bin/sh"):
        program = root / of_others
        program.parent.mkdir(parents=True, exist_ok=True)
        program.touch()
        program.chmod(0o755)
    for target in ("network-online", "time-sync", "multi-user", "sysinit", "basic", "shutdown"):
        (root / f"usr/lib/systemd/system/{target}.target").write_text("[Unit]\nDescription=stands for systemd's own\n")
    done = subprocess.run(["systemd-analyze", "verify", "--root", str(root), "--man=no", "--recursive-errors=no",
                           *[u.name for u in units]], capture_output=True, text=True)
    ours = [line for line in done.stderr.splitlines() if "phantom" in line]
    assert done.returncode == 0 and not ours, done.stderr
    return "units verified by systemd"


def main():
    for tool in ("cpack", "dpkg-deb", "dpkg-shlibdeps"):
        if shutil.which(tool) is None:
            print(f"skipped: {tool} is missing; scripts/setup installs it")
            sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run("cpack", "-G", "DEB", "-D", f"CPACK_OUTPUT_FILE_PREFIX={folder}", "--config", BUILD / "CPackConfig.cmake", cwd=folder)
        debs = {field(deb, "Package"): deb for deb in folder.glob("*.deb")}
        assert set(debs) == {"phantom-common", "phantom-haptic-device", *map(name_of, COMPONENTS)}, sorted(debs)
        owner, root = {}, folder / "root"
        root.mkdir()
        for package, deb in sorted(debs.items()):
            run("dpkg-deb", "-x", deb, root / package)
            files = {"/" + str(f.relative_to(root / package)) for f in (root / package).rglob("*") if not f.is_dir()}
            for file in files:
                assert file.startswith(("/usr/",)), f"{package}: {file}"
                assert file not in owner, f"{file} is in {owner.get(file)} and {package}"
                owner[file] = package
            if package == "phantom-common":
                check_common(deb, files)
            elif package == "phantom-haptic-device":
                check_haptic_device(deb, files, root / package, folder)
            else:
                check_package(deb, next(c for c in COMPONENTS if name_of(c) == package), files)
        whole = folder / "whole"
        for deb in debs.values():
            run("dpkg-deb", "-x", deb, whole)
        bill = check_bill(whole)
        units = check_units(whole)
        # The installed tree stands on its own: executables find configuration and cells below their own prefix.
        for component in COMPONENTS:
            run(whole / "usr/bin" / component, "--version")
        run(whole / "usr/bin/wva_server", "--check")
        # An OBJ is read by the importer, which stands below the prefix, too.
        run(whole / "usr/bin/wva_server", "activate", "--mesh", whole / "usr/share/phantom/deploy/parts/wedge.obj", "--scale", "0.001",
            "--voxel-size-m", "0.01", "--layers", "2,2", "--mu", "2,1", "--export", folder / "wedge.nrrd")
        print(f"{len(debs)} packages, {len(owner)} files, {bill}, {units}")


main()
