"""`squeal critical-speeds`: speeds of a rotor at which a whirl frequency is the speed, or a
multiple of it, with whirl directions and the Campbell diagram.

squeal critical-speeds rotor.yaml --max 900 --figure campbell.png
squeal critical-speeds rotor.yaml --max 900 --orders 1:2 --band 10:1000
"""

import argparse
import math

import numpy as np

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import NUMBER, add_option, numbers, take, take_files, write_files
from squeal.errors import InputError


def _are_orders(low: float, high: float = math.nan) -> bool:
    """True if the order `low`, or orders from low to high, are allowed: multiples of the speed."""
    highest = low if math.isnan(high) else high
    return 0.0 < low <= highest <= 100.0 and (highest - low) % 1.0 == 0.0


def _orders(low: float, high: float = 0.0) -> tuple[float, ...]:
    """The orders from low to high, one apart, both included; low alone without a high."""
    return tuple(np.arange(low, max(low, high) + 0.5).tolist())


ORDERS = numbers(
    "N, or LOW:HIGH a whole number apart, above 0 and at most 100, such as 1:3",
    _are_orders,
    _orders,
)


def options(parser: Parser) -> None:
    """Options of `squeal critical-speeds`."""
    add_option(
        parser,
        "--max --mu-max",
        dest="high",
        metavar="VALUE",
        read=NUMBER,
        help="highest speed, rad/s (required)",
    )
    take(parser, "low", "band", "memory")
    add_option(
        parser,
        "--orders",
        metavar="LOW:HIGH",
        read=ORDERS,
        default=(1.0,),
        help="multiples of the speed: one, or LOW:HIGH in steps of 1 (1)",
    )
    take_files(parser, table="the critical speeds", figure="the Campbell diagram")


def run(given: argparse.Namespace) -> Reply:
    """Read the rotor and answer."""
    subject = given.source.system("a system with a speed")
    if given.high is None:
        raise InputError("--max: missing; the highest speed in rad/s is required")
    answer = squeal.critical_speeds(
        subject,
        low=given.low or 0.0,
        high=given.high,
        orders=given.orders,
        band=given.band,
        memory=given.memory,
    )
    write_files(given, answer)
    return Reply.of(answer)
