"""Licences, bans and sources of deny.toml, checked on the output of `cargo metadata`: for machines without cargo-deny."""

import json
import re
import sys
import tomllib


def allowed(expression, allow):
    """Whether an SPDX expression can be met by the licences that are allowed. A slash is the old way to say OR."""
    tokens = re.findall(r"\(|\)|[^\s()]+", expression.replace("/", " OR "))
    position = 0

    def alternatives():
        nonlocal position
        met = conjunction()
        while position < len(tokens) and tokens[position] == "OR":
            position += 1
            met = conjunction() or met
        return met

    def conjunction():
        nonlocal position
        met = single()
        while position < len(tokens) and tokens[position] == "AND":
            position += 1
            met = single() and met
        return met

    def single():
        nonlocal position
        token = tokens[position]
        position += 1
        if token == "(":
            met = alternatives()
            position += 1
            return met
        if position < len(tokens) and tokens[position] == "WITH":
            token += " WITH " + tokens[position + 1]
            position += 2
        return token in allow

    return alternatives()


def main():
    with open(sys.argv[1], "rb") as file:
        deny = tomllib.load(file)
    packages = json.load(sys.stdin)["packages"]
    allow = set(deny["licenses"]["allow"])
    banned = {ban["name"]: ban["reason"] for ban in deny["bans"]["deny"]}
    problems = []
    for package in packages:
        name = f"{package['name']} {package['version']}"
        if not package["license"] or not allowed(package["license"], allow):
            problems.append(f"{name}: the licence {package['license']} is not in deny.toml's list")
        if package["name"] in banned:
            problems.append(f"{name}: banned, {banned[package['name']]}")
        source = package["source"]
        if source is not None and not source.startswith("registry+https://github.com/rust-lang/crates.io-index"):
            problems.append(f"{name}: comes from {source}, not from crates.io")
    for problem in problems:
        print(f"error: {problem}", file=sys.stderr)
    print(f"{len(packages)} packages: licences, bans and sources {'not ' if problems else ''}as deny.toml asks")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
