#!/usr/bin/env python3
"""Holds `wva_server activate` to an independent exact distance transform (SciPy), in every voxel.

Parts of the mesh importer's own collection, in many formats, and every object of the shipped cell are activated one by
one: of each exported solid the distance transform must give the exported layers, guard skin and inside layers. The cell
as a whole must be the objects' volumes merged: in every voxel the higher viscosity prevails, then the lower object id.

usage: activation_oracle_test.py WVA_SERVER [CELL.yaml]
"""

import gzip
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy
import yaml
from scipy.ndimage import distance_transform_edt

MODELS = Path("/usr/share/assimp/models")
PARTS = [
    "STL/Spider_ascii.stl", "STL/Spider_binary.stl", "OBJ/spider.obj", "OBJ/box.obj", "PLY/Wuson.ply", "OFF/Cube.off",
    "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb", "glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb",
    "Collada/duck.dae", "X/Testwuson.X", "3MF/box.3mf", "FBX/spider.fbx", "3DS/fels.3ds", "AMF/test1.amf",
    "LWO/LWO2/sphere_with_mat_gloss_10pc.lwo", "BLEND/BlenderDefault_271.blend"]
BOUNDARY, INTERIOR, GUARD = 100, 101, 99
LAYERS, MU, SKIN = [2, 1, 3, 2], [32.0, 20.0, 13.0, 11.0], 100.0


def read_nrrd(path):
    """Array in x, y, z and the centre of voxel (0, 0, 0)."""
    head, _, body = Path(path).read_bytes().partition(b"\n\n")
    fields = dict(line.split(": ", 1) for line in head.decode().split("\n") if ": " in line and not line.startswith("#"))
    types = {"int8": "i1", "uint16": "<u2", "float": "<f4"}
    sizes = [int(n) for n in fields["sizes"].split()]
    raw = gzip.decompress(body) if fields["encoding"] == "gzip" else body
    origin = [float(n) for n in fields["space origin"].strip("()").split(",")]
    array = numpy.frombuffer(raw, types[fields["type"]]).reshape(sizes[::-1]).transpose(2, 1, 0)
    return array, numpy.array(origin)


def activate(server, out, *arguments):
    done = subprocess.run([server, "activate", "--export", str(out), *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        return None, done
    return json.loads(done.stdout.strip().split("\n")[-1]), done


def orders_by_distance(outside_of, thickness, guard):
    """Order of each voxel by its exact distance to the nearest voxel of a solid; 0 where it is farther than all layers."""
    square = numpy.rint(distance_transform_edt(~outside_of) ** 2).astype(numpy.int64)
    orders = numpy.zeros(square.shape, numpy.int16)
    until = guard + sum(thickness)
    for order in range(len(thickness), 0, -1):
        orders[square <= until * until] = order
        until -= thickness[order - 1]
    if guard:
        orders[square <= guard * guard] = GUARD
    return orders


def check_volume(name, orders, thickness, guard, inside):
    orders = orders.astype(numpy.int16)
    solid = (orders >= BOUNDARY) | (orders < 0)
    if not solid.any():
        return [f"{name}: no solid"]
    expected = orders_by_distance(solid, thickness, guard)
    core = (orders == INTERIOR) | (orders < 0)
    depth = orders_by_distance(~core, inside, 0) if inside else numpy.zeros_like(expected)
    expected[core] = numpy.where(depth[core] > 0, -depth[core], INTERIOR)
    expected[orders == BOUNDARY] = BOUNDARY
    wrong = int((orders != expected).sum())
    return [f"{name}: {wrong} of {orders.size} voxels differ from the distance transform"] if wrong else []


def check_parts(server, folder):
    problems, formats = [], set()
    for i, part in enumerate(PARTS):
        guard, inside = i % 3, [0, 2, 1][i % 3]
        arguments = ["--mesh", str(MODELS / part), "--fit-extent-m", "0.3", "--voxel-size-m", "0.004",
                     "--pose", "0.0113 0.0071 0.0053 10 20 30", "--layers", ",".join(map(str, LAYERS)),
                     "--mu", ",".join(map(str, MU)), "--guard", str(guard), "--inside", str(inside)]
        told, done = activate(server, folder / "part.nrrd", *arguments)
        if told is None:
            problems.append(f"{part}: exit code {done.returncode}: {done.stderr.strip()}")
            continue
        formats.add(Path(part).suffix.lower())
        orders, _ = read_nrrd(folder / "part.nrrd")
        if list(orders.shape) != told["size_vox"]:
            problems.append(f"{part}: the file has {orders.shape}, the command says {told['size_vox']}")
        problems += check_volume(part, orders, LAYERS, guard, [LAYERS[0]] * inside)
        print(f"{part}: {orders.size} voxels", flush=True)
    print(f"{len(PARTS)} parts in {len(formats)} formats")
    return problems


def object_arguments(cell, cell_file, entry):
    pose = entry.get("pose", {})
    numbers = list(pose.get("xyz_m", [0, 0, 0])) + list(pose.get("rpy_deg", [0, 0, 0]))
    profile = {**cell["profile"], **entry.get("profile", {})}
    return profile, ["--mesh", str(cell_file.parent / entry["mesh"]), "--scale", str(entry.get("mesh_scale", 1.0)),
                     "--up-axis", entry.get("up_axis", "z"), "--pose", " ".join(map(str, numbers)),
                     "--voxel-size-m", str(cell["workspace"]["voxel_size_m"]),
                     "--layers", ",".join(map(str, profile["thickness_vox"])),
                     "--mu", ",".join(map(str, profile["mu_Pa_s_per_m"])),
                     "--mu-skin", str(profile.get("mu_skin_Pa_s_per_m", SKIN)), "--guard", str(profile.get("guard_vox", 0))]


def mu_of(orders, profile):
    mu = numpy.zeros(256, numpy.float32)
    mu[BOUNDARY] = mu[INTERIOR] = profile.get("mu_skin_Pa_s_per_m", SKIN)
    mu[1:1 + len(profile["mu_Pa_s_per_m"])] = profile["mu_Pa_s_per_m"]
    mu[GUARD] = profile["mu_Pa_s_per_m"][0]
    return mu[orders.astype(numpy.uint8)]


def overlap(offset, size, whole):
    """Slices of a part in itself and in the whole, along each axis."""
    mine, its = [], []
    for at, count, most in zip(offset, size, whole):
        low, high = max(0, at), min(most, at + count)
        mine.append(slice(low - at, max(low, high) - at))
        its.append(slice(low, max(low, high)))
    return tuple(mine), tuple(its)


def check_cell(server, cell_file, folder):
    cell = yaml.safe_load(cell_file.read_text())
    problems, told = [], {}
    for field in ("order", "mu", "object"):
        line, done = activate(server, folder / f"{field}.nrrd", "--cell", str(cell_file), "--field", field)
        if line is None:
            return [f"{cell_file}: exit code {done.returncode}: {done.stderr.strip()}"]
        told[field], origin = read_nrrd(folder / f"{field}.nrrd")
    shape = told["order"].shape
    order, mu, owner = numpy.zeros(shape, numpy.int8), numpy.zeros(shape, numpy.float32), numpy.zeros(shape, numpy.uint16)
    for number, entry in enumerate(cell["objects"], 1):
        profile, arguments = object_arguments(cell, cell_file, entry)
        line, done = activate(server, folder / "object.nrrd", *arguments)
        if line is None:
            problems.append(f"{entry['name']}: exit code {done.returncode}: {done.stderr.strip()}")
            continue
        orders, corner = read_nrrd(folder / "object.nrrd")
        problems += check_volume(entry["name"], orders, profile["thickness_vox"], profile.get("guard_vox", 0), [])
        offset = numpy.rint((corner - origin) / cell["workspace"]["voxel_size_m"]).astype(int)
        mine, its = overlap(offset, orders.shape, shape)
        part, strength = orders[mine], mu_of(orders[mine], profile)
        stronger = strength > mu[its]
        order[its][stronger], mu[its][stronger], owner[its][stronger] = part[stronger], strength[stronger], number
        print(f"{entry['name']}: {orders.size} voxels", flush=True)
    for field, expected in (("order", order), ("mu", mu), ("object", owner)):
        wrong = int((told[field] != expected).sum())
        if wrong:
            problems.append(f"{cell_file.name}: {wrong} of {expected.size} voxels of field {field} are not the merged objects'")
    print(f"{cell_file.name}: {order.size} voxels, {len(cell['objects'])} objects")
    return problems


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    server = sys.argv[1]
    with tempfile.TemporaryDirectory() as name:
        problems = check_parts(server, Path(name))
        for cell_file in sys.argv[2:]:
            problems += check_cell(server, Path(cell_file), Path(name))
    print("\n".join(problems) if problems else "every voxel agrees")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
