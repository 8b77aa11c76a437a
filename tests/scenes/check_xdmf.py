#!/usr/bin/env python3
"""Checks that an XDMF file of dlmfd says the truth about its HDF5 file.

    check_xdmf.py FIELDS.XMF [--steps N]

Every referenced dataset must exist with the stated shape, type and precision; the arrays of a grid must fit its
topology; the repeated planes of periodic axes must equal the first ones; times must ascend.
"""
import argparse
import math
import os
import sys
import xml.etree.ElementTree as ElementTree

import h5py
import numpy

COMPONENTS = {"Scalar": (), "Vector": (3,), "Matrix": (6,)}
KINDS = {"Float": "f", "Int": "i"}


class Mismatch(Exception):
    pass


def require(condition, message):
    if not condition:
        raise Mismatch(message)


def numbers(text):
    return tuple(int(word) for word in text.split())


def read_item(item, folder):
    """The array behind a DataItem, checked against its attributes."""
    shape = numbers(item.get("Dimensions"))
    if item.get("Format") == "XML":
        values = numpy.array([float(word) for word in item.text.split()])
        require(values.size == math.prod(shape), f"{item.get('Name')}: {values.size} values, {shape} stated")
        return values
    name, _, path = item.text.strip().partition(":")
    with h5py.File(os.path.join(folder, name), "r") as h5:
        require(path in h5, f"{name} has no dataset {path}")
        data = h5[path]
        require(data.shape == shape, f"{path}: shape {data.shape}, {shape} stated")
        require(data.dtype.kind == KINDS[item.get("NumberType")], f"{path}: type {data.dtype}")
        require(data.dtype.itemsize == int(item.get("Precision")), f"{path}: type {data.dtype}")
        return data[...]


def check_attributes(grid, shape, folder):
    """Attributes of a grid against its nodes; returns the arrays by name."""
    arrays = {}
    for attribute in grid.iter("Attribute"):
        values = read_item(attribute.find("DataItem"), folder)
        want = shape + COMPONENTS[attribute.get("AttributeType")]
        require(values.shape == want, f"{attribute.get('Name')}: shape {values.shape}, grid needs {want}")
        require(numpy.isfinite(values).all(), f"{attribute.get('Name')}: not finite")
        arrays[attribute.get("Name")] = values
    return arrays


def check_mesh(grid, folder):
    shape = numbers(grid.find("Topology").get("Dimensions"))
    geometry = grid.find("Geometry")
    require(geometry.get("GeometryType") == "ORIGIN_DXDYDZ", "unexpected geometry")
    origin, spacing = (read_item(item, folder) for item in geometry)
    with h5py.File(os.path.join(folder, "fields.h5"), "r") as h5:
        mesh = h5["meshes"][grid.get("Name")].attrs
        periodic = mesh["periodic"][::-1]
        require(tuple(mesh["nodes"][::-1] + periodic) == shape, f"{grid.get('Name')}: nodes differ from {shape}")
        require(numpy.array_equal(mesh["origin"][::-1], origin), f"{grid.get('Name')}: origin differs")
        require(numpy.array_equal(mesh["spacing"][::-1], spacing), f"{grid.get('Name')}: spacing differs")
    for name, values in check_attributes(grid, shape, folder).items():
        for axis in numpy.flatnonzero(periodic):
            first, last = values.take(0, axis), values.take(-1, axis)
            require(numpy.array_equal(first, last), f"{name}: not closed along x{3 - axis}")


def check_points(grid, folder):
    name, topology = grid.get("Name"), grid.find("Topology")
    count = int(topology.get("NumberOfElements"))
    ids = read_item(topology.find("DataItem"), folder)
    require(numpy.array_equal(ids, numpy.arange(count)), f"{name}: ids are not 0..n-1")
    positions = read_item(grid.find("Geometry/DataItem"), folder)
    require(positions.shape == (count, 3) and numpy.isfinite(positions).all(), f"{name}: positions of shape {positions.shape}")
    arrays = check_attributes(grid, (count,), folder)
    require(numpy.array_equal(arrays["id"], ids), f"{name}: id is no array of its own")
    require(name != "spheres" or (arrays["radius"] > 0).all(), "spheres: radius not positive")


def check(path):
    folder = os.path.dirname(os.path.abspath(path))
    root = ElementTree.parse(path).getroot()
    require(root.tag == "Xdmf" and root.get("Version").startswith("3"), "not an XDMF 3 file")
    times = []
    for step in root.find("Domain/Grid[@CollectionType='Temporal']"):
        times.append(float(step.find("Time").get("Value")))
        for grid in step.findall("Grid"):
            if grid.find("Topology").get("TopologyType") == "3DCoRectMesh":
                check_mesh(grid, folder)
            else:
                check_points(grid, folder)
    require(times == sorted(set(times)), f"times do not ascend: {times}")
    return len(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("xmf")
    parser.add_argument("--steps", type=int, help="number of steps the file must hold")
    arguments = parser.parse_args()
    try:
        steps = check(arguments.xmf)
        require(arguments.steps in (None, steps), f"{steps} steps, expected {arguments.steps}")
    except (Mismatch, OSError, KeyError, ElementTree.ParseError) as error:
        sys.exit(f"{arguments.xmf}: {error}")
    print(f"{arguments.xmf}: {steps} steps, all as stated")


if __name__ == "__main__":
    main()
