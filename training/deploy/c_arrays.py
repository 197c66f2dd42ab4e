"""Numbers as C writes them, and a policy's layers as constant arrays."""

from textwrap import fill

import numpy as np
from numpy.typing import NDArray

from controllers.learned import LearnedPolicy
from training.deploy.quantisation import FixedLayer, FixedPolicy


def listed(values: NDArray) -> str:
    """Numbers of an array of any shape, row after row, as C writes them, on indented lines."""
    text = ", ".join(literal(value) for value in values.ravel())
    return f"\n{fill(text, 100, initial_indent='    ', subsequent_indent='    ')}\n"


def literal(value: float | np.generic) -> str:
    """A number in C; nine digits give a float back to the bit."""
    if isinstance(value, (float, np.floating)):
        text = f"{value:.9g}"
        return f"{text}f" if any(mark in text for mark in ".e") else f"{text}.0f"
    return f"{value}u" if isinstance(value, np.unsignedinteger) else str(value)


def named_layers(policy: LearnedPolicy) -> dict[str, tuple[NDArray, NDArray]]:
    """Weight (outputs, inputs) and bias (outputs,) of each layer by its name in C.

    A recurrent unit has two layers: NEW of the observation, OLD of the cells.
    """
    layers = {str(k): layer for k, layer in enumerate(policy.layers)}
    unit = policy.cell
    if unit is not None:
        layers["NEW"] = unit.weight_input, unit.bias_input
        layers["OLD"] = unit.weight_memory, unit.bias_memory
    return layers


def named_fixed_layers(fixed: FixedPolicy) -> dict[str, FixedLayer]:
    """The same in integers."""
    layers = {str(k): layer for k, layer in enumerate(fixed.layers)}
    return (
        layers
        if fixed.cell is None
        else layers | {"NEW": fixed.cell.of_observation, "OLD": fixed.cell.of_cells}
    )


def float_tables(policy: LearnedPolicy) -> dict[str, str]:
    """A policy's layers in C: see _tables."""
    return _tables({name: _float_layer(name, *layer) for name, layer in named_layers(policy).items()})


def fixed_tables(fixed: FixedPolicy) -> dict[str, str]:
    """The same in integers."""
    return _tables({name: _fixed_layer(name, each) for name, each in named_fixed_layers(fixed).items()})


def _tables(layers: dict[str, tuple[list[str], str]]) -> dict[str, str]:
    """All arrays, the table of the perceptron's layers, and each layer's structure by its name."""
    structures = {name: structure for name, (_, structure) in layers.items()}
    return structures | {
        "arrays": "\n".join(array for arrays, _ in layers.values() for array in arrays),
        "network": "".join(f"    {each},\n" for name, each in structures.items() if name.isdigit()),
    }


def _float_layer(name: str, weight: NDArray, bias: NDArray) -> tuple[list[str], str]:
    """A layer's arrays and structure in C, from weight (outputs, inputs) and bias (outputs,)."""
    arrays = [
        _array(f"const float WEIGHT_{name}[{weight.size}]", weight.astype(np.float32)),
        _array(f"const float BIAS_{name}[{bias.size}]", bias.astype(np.float32)),
    ]
    return arrays, f"{{WEIGHT_{name}, BIAS_{name}, {weight.shape[1]}, {weight.shape[0]}}}"


def _fixed_layer(name: str, layer: FixedLayer) -> tuple[list[str], str]:
    """The same in integers."""
    outputs, inputs = layer.weight.shape
    arrays = [
        _array(f"const int8_t WEIGHT_{name}[{layer.weight.size}]", layer.weight),
        _array(f"const uint32_t FACTOR_{name}[{outputs}]", layer.factor),
        _array(f"const int32_t BIAS_{name}[{outputs}]", layer.bias),
    ]
    numbers = f"{inputs}, {outputs}, {layer.shift}"
    return arrays, f"{{WEIGHT_{name}, FACTOR_{name}, BIAS_{name}, {numbers}}}"


def _array(declaration: str, values: NDArray) -> str:
    """The definition of a constant array; values of any shape, row after row."""
    return f"static {declaration} = {{{listed(values)}}};\n"
