"""The rows of the benchmarks (tests/bench/rows): what each compares, which limit holds, and what it is worth. No process, no clock."""
import json
import re
import statistics

REQUIRED, OPTIONAL = {"name", "work", "bench", "value"}, {"must", "aim", "peer", "slow"}
LIMIT = re.compile(r"(<=|>=) (\d+(?:\.\d+)?)")
BANDWIDTH = re.compile(r"(>=|<) (\d+(?:\.\d+)?) GB/s")
SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
# What Google Benchmark appends to a benchmark's name by how it is run.
HOW_IT_IS_RUN = "/(iterations|repeats):[0-9]+|/process_time|/real_time|/manual_time"
UNMET = ("MISSED", "not measured")


class RowError(Exception):
    """A row that cannot be judged as it is written."""


def load_rows(folder):
    """Returns all rows of `folder`, each with the name of its table. Raises RowError naming the file and the row."""
    rows, tables = [], {}
    for file in sorted(folder.glob("*.json")):
        try:
            listed = json.loads(file.read_text())
        except json.JSONDecodeError as problem:
            raise RowError(f"{file}: {problem}") from problem
        for row in listed:
            try:
                check(row)
            except RowError as problem:
                raise RowError(f"{file}: row {row.get('name', '?')}: {problem}") from problem
            if row["name"] in tables:
                raise RowError(f"{file}: row {row['name']}: {tables[row['name']]} has a row of this name")
            tables[row["name"]] = file.name
            rows.append({"table": file.stem, **row})
    return rows


def check(row):
    """Raises RowError if keys are missing or unknown, or a limit is not one."""
    if missing := sorted(REQUIRED - row.keys()):
        raise RowError(f"{missing[0]} is missing")
    if unknown := sorted(row.keys() - REQUIRED - OPTIONAL):
        raise RowError(f"{unknown[0]}: no such key; allowed: {', '.join(sorted(REQUIRED | OPTIONAL))}")
    for side in row["value"]:
        if isinstance(side, str) and ":" not in side:
            raise RowError(f'value {side!r}; allowed: a number, or "cpu:", "wall:" or "COUNTER:" and a benchmark')
    if len(row["value"]) != 2:
        raise RowError("value has two sides, over and under")
    for name in row.get("slow", []):
        if name not in benchmarks(row):
            raise RowError(f"slow {name!r} is none of its benchmarks: {', '.join(benchmarks(row))}")
    for key in ("must", "aim"):
        check_limit(key, row)


def check_limit(key, row):
    """A limit is one for all machines, or two by the bandwidth of memory that the second benchmark states."""
    limit = row.get(key)
    if limit is None:
        return
    allowed = f'{key} {limit!r}; allowed: "<= 2.5", ">= 2", or {{">= 30 GB/s": "<= 22", "< 30 GB/s": "<= 15"}}'
    if isinstance(limit, dict):
        conditions = [BANDWIDTH.fullmatch(condition) for condition in limit]
        if None in conditions or sorted(c[1] for c in conditions) != ["<", ">="] or len({c[2] for c in conditions}) != 1:
            raise RowError(allowed)
        if not isinstance(sides(row)[1], tuple):
            raise RowError(f"{key} goes by memory's bandwidth, and value's second side is no benchmark that states it")
    for each in limit.values() if isinstance(limit, dict) else [limit]:
        if not isinstance(each, str) or not LIMIT.fullmatch(each):
            raise RowError(allowed)


def select(rows, names):
    """Returns the rows of these tables or names, all of them without names. Raises RowError for a name that is neither."""
    known = {row["table"] for row in rows} | {row["name"] for row in rows}
    if unknown := [name for name in names if name not in known]:
        raise RowError(f"{unknown[0]}: no such table or row; allowed: {', '.join(sorted(known))}")
    return [row for row in rows if not names or row["table"] in names or row["name"] in names]


def sides(row):
    """Returns (what, benchmark) of both sides of a row; a number stands for itself."""
    return [tuple(side.split(":", 1)) if isinstance(side, str) else side for side in row["value"]]


def benchmarks(row):
    """Returns the names of the row's benchmarks."""
    return [side[1] for side in sides(row) if isinstance(side, tuple)]


def benchmark_name(reported):
    """Returns the name under which a benchmark was registered."""
    return re.sub(HOW_IT_IS_RUN, "", reported)


def filter_of(names):
    """Returns the regular expression by which Google Benchmark runs these benchmarks and no other."""
    return "^(" + "|".join(re.escape(name) for name in sorted(names)) + f")({HOW_IT_IS_RUN})*$"


def peer_is_missing(row, registered):
    """Returns whether the row compares with a peer of which its executable, with these benchmarks, has none: it is not installed."""
    return "peer" in row and not any(name.startswith(row["peer"].lower()) for name in registered)


def unregistered(rows, registered):
    """Returns a sentence for each benchmark that a row names and its executable does not have.

    `registered`: {executable: names}. A peer's benchmarks are excepted where the executable has none of that peer, which is then not installed.
    """
    faults = []
    for row in rows:
        there = registered[row["bench"]]
        for name in benchmarks(row):
            excepted = peer_is_missing(row, there) and name.startswith(row["peer"].lower())
            if name not in there and not excepted:
                faults.append(f"{row['table']}.json: row {row['name']}: {row['bench']}_bench has no benchmark {name}")
    return faults


def median(results, what):
    """Returns the median of `what` over repetitions: time of an iteration in seconds (cpu, wall), or a counter."""
    if what in ("cpu", "wall"):
        key = "cpu_time" if what == "cpu" else "real_time"
        return statistics.median(r[key] * SECONDS[r["time_unit"]] for r in results)
    return statistics.median(r[what] for r in results)


def limit_that_holds(limit, bandwidth_GB_s):
    """Returns the limit of a row on a machine with this bandwidth of memory; null: there is none."""
    if not isinstance(limit, dict):
        return limit
    for condition, of_bandwidth in limit.items():
        relation, bound = BANDWIDTH.fullmatch(condition).groups()
        if (bandwidth_GB_s >= float(bound)) == (relation == ">="):
            return of_bandwidth
    raise AssertionError("check_limit() lets one of both conditions hold")


def holds(value, limit):
    """Returns whether the value keeps the limit; null: there is none."""
    if limit is None:
        return None
    relation, number = LIMIT.fullmatch(limit).groups()
    return value <= float(number) if relation == "<=" else value >= float(number)


def judge(row, results, registered):
    """Returns the row with its limits, ratio, seconds of its benchmarks and verdict.

    `results`: {executable: {benchmark: repetitions}}; `registered`: {executable: names}. A verdict of UNMET means that the row fails.
    """
    values, times, bandwidth_GB_s = [], [], None
    for side in sides(row):
        if not isinstance(side, tuple):
            values.append(float(side))
            continue
        what, name = side
        found = results.get(row["bench"], {}).get(name)
        if not found:
            both = {key: " or ".join(row[key].values()) for key in ("must", "aim") if isinstance(row.get(key), dict)}
            missing = peer_is_missing(row, registered[row["bench"]])
            return {**row, **both, "verdict": f"{row['peer']} not installed" if missing else "not measured"}
        values.append(median(found, what))
        times.append(median(found, "cpu"))
        bandwidth_GB_s = median(found, "bytes_per_second") / 1e9 if "bytes_per_second" in found[0] else None
    limits = {}
    for key in {"must", "aim"} & row.keys():
        if isinstance(row[key], dict) and bandwidth_GB_s is None:
            raise RowError(f"row {row['name']}: {benchmarks(row)[-1]} states no bytes_per_second, by which {key} goes")
        limits[key] = limit_that_holds(row[key], bandwidth_GB_s)
    ratio = values[0] / values[1]
    must, aim = holds(ratio, limits.get("must")), holds(ratio, limits.get("aim"))
    verdict = "MISSED" if must is False else "aim" if aim else "must" if must else "stated"
    by = {"GB_per_s": bandwidth_GB_s} if bandwidth_GB_s is not None else {}
    return {**row, **limits, **by, "ratio": ratio, "seconds": times, "verdict": verdict}
