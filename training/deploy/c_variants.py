"""The two C variants of a policy, in single precision and in integers: what their files differ in."""

from dataclasses import asdict, dataclass


@dataclass(frozen=True, kw_only=True)
class Variant:
    """What fills the templates of a variant: types, units, words; not its arithmetic."""

    name: str
    """`float` or `fixed`: part of every public name in C."""
    reading: str
    """C type of a reading."""
    difference: str
    """C type of a difference of two readings."""
    signal: str
    """C type of an observation's entry and of an activation."""
    sum: str
    """C type of a layer's sum, and of a logit."""
    cell_member: str
    """Member of the memory for the cells; a policy without cells has none: C99 has no empty array."""
    pressure_unit: str
    current_unit: str
    p2_error: str
    """p2 minus target in C, in the unit of a pressure."""
    action: str
    """What the coil did in C, in the unit of the observation's entry."""
    arithmetic_in_words: str
    same_everywhere: str
    numbers_in_words: str
    observation_in_words: str
    logit_scale: str
    tie_in_words: str

    def template_fields(self, cells: int) -> dict[str, str]:
        """What the templates call these fields. cells: of the policy's recurrent unit, or 0."""
        member = self.cell_member.format(cells) if cells else ""
        names = {"variant": self.name, "capital": self.name.upper(), "cell_member": member}
        return asdict(self) | names


FLOAT = Variant(
    name="float",
    reading="float",
    difference="float",
    signal="float",
    sum="float",
    cell_member="    float cell[{}]; /* of the gated recurrent unit */\n",
    pressure_unit="bar",
    current_unit="A",
    p2_error="now->p2 - now->target",
    action="(float)now->coil",
    arithmetic_in_words="The policy in single precision, from the readings to the decision.",
    same_everywhere="",
    numbers_in_words="All numbers are float, in the units of the readings and of the observation.",
    observation_in_words="A reading that is not a number gives 1: the valve shuts.",
    logit_scale="",
    tie_in_words=" /* not-a-number compares false: 1, shut */",
)

FIXED = Variant(
    name="fixed",
    reading="int32_t",
    difference="int64_t",
    signal="int16_t",
    sum="int32_t",
    cell_member=(
        "    int32_t cell[{}]; /* of the gated recurrent unit, 32767 * 32768 stands for 1 */\n"
    ),
    pressure_unit="Pa",
    current_unit="uA",
    p2_error="(int64_t)now->p2 - now->target",
    action="now->coil ? 1000 : 0",
    arithmetic_in_words=(
        "The policy in integers alone, from the readings to the decision: for units without "
        "floating point."
    ),
    same_everywhere=" The same decisions on every machine.",
    numbers_in_words=(
        "Observations and activations: int16_t, 32767 stands for the reach of an entry or for 1.\n"
        " * Weights: int8_t, one scale for each row. Sums: int32_t, they cannot overflow (the export\n"
        " * checks it). What tanh is taken of, and the logits: int32_t, 65536 stands for 1."
    ),
    observation_in_words=(
        "32767 stands for the reach of an entry (contract.json); beyond its reach an entry saturates."
    ),
    logit_scale=", 65536 stands for 1",
    tie_in_words="",
)

VARIANTS = (FLOAT, FIXED)
