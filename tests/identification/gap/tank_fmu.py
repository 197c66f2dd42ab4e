"""A tiny FMU for co-simulation (FMI 2.0), built with a C compiler: the tank without its sensor."""

import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

SOURCE = """
#include <math.h>
#include <stdlib.h>
typedef struct { double v[6]; } Tank; /* time, inflow, level, c, leak, start */
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(Tank *t, int on, size_t n, const char *const names[]) { return 0; }
Tank *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *callbacks, int visible, int logging) {
  Tank *t = calloc(1, sizeof(Tank));
  t->v[3] = 0.02;
  return t;
}
void fmi2FreeInstance(Tank *t) { free(t); }
int fmi2SetupExperiment(Tank *t, int has_tolerance, double tolerance, double start, int has_stop,
                        double stop) {
  t->v[0] = start;
  return 0;
}
int fmi2EnterInitializationMode(Tank *t) { return 0; }
int fmi2ExitInitializationMode(Tank *t) { t->v[2] = t->v[5]; return 0; }
int fmi2Terminate(Tank *t) { return 0; }
int fmi2Reset(Tank *t) { return 0; }
int fmi2GetReal(Tank *t, const unsigned r[], size_t n, double x[]) {
  for (size_t i = 0; i < n; i++) x[i] = t->v[r[i]];
  return 0;
}
int fmi2SetReal(Tank *t, const unsigned r[], size_t n, const double x[]) {
  for (size_t i = 0; i < n; i++) t->v[r[i]] = x[i];
  return 0;
}
int fmi2DoStep(Tank *t, double time, double h, int keep) {
  double *v = t->v;
  if (v[4] > 1.0) return 3; /* nobody leaks that much */
  for (int k = 0; k < 100; k++) {
    double level = fmax(v[2], 1e-6);
    v[2] += h / 100 * (v[1] / 0.5 - v[3] * sqrt(level) - v[4] * level);
  }
  v[0] = time + h;
  return 0;
}
"""

NEVER_CALLED = (
    "GetInteger", "GetBoolean", "GetString", "SetInteger", "SetBoolean", "SetString", "GetFMUstate",
    "SetFMUstate", "FreeFMUstate", "SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate",
    "GetDirectionalDerivative", "SetRealInputDerivatives", "GetRealOutputDerivatives", "CancelStep",
    "GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus",
)  # fmt: skip
"""Functions that an FMU for co-simulation must have."""

PARAMETER = """
<ScalarVariable name="{name}" valueReference="{reference}" causality="parameter" variability="tunable">
<Real start="{start}"/></ScalarVariable>"""

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="tank" guid="{{tank}}">
<CoSimulation modelIdentifier="tank" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="q" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="h" valueReference="2" causality="output"><Real/></ScalarVariable>{parameters}
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>
</fmiModelDescription>
"""


def build_tank_fmu(folder: Path) -> Path:
    """Compile the FMU for Linux, 64 bit; folder: for the result."""
    unused = "".join(f"int fmi2{name}(void) {{ return 3; }}\n" for name in NEVER_CALLED)
    (folder / "tank.c").write_text(SOURCE + unused)
    library = folder / "tank.so"
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O1", "-w", "-o", library, folder / "tank.c", "-lm"], check=True
    )
    rows = (("c", 3, 0.02), ("leak", 4, 0.0), ("h_start", 5, 0.5))
    parameters = "".join(
        PARAMETER.format(name=name, reference=reference, start=start) for name, reference, start in rows
    )
    with ZipFile(folder / "tank.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.format(parameters=parameters))
        archive.write(library, "binaries/linux64/tank.so")
    return folder / "tank.fmu"


def can_build() -> bool:
    """Whether the FMU's binary folder is that of this machine."""
    return sys.platform == "linux" and sys.maxsize > 2**32
