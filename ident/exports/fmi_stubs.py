"""Functions that FMI asks of every FMU and that a boat stepped by itself has no use for.

Names and arguments are those of the FMI standards 2.0.4 and 3.0.1 (Modelica Association); each such
function says that it is not supported. Of functions that stand for each type of number there is one a type.
"""

from __future__ import annotations

_N = "size_t n"
_REFS = "const fmi3ValueReference refs[], size_t count"

# Name -> arguments after the instance.
FMI2 = {
    "GetInteger": "const fmi2ValueReference refs[], size_t count, int values[]",
    "GetBoolean": "const fmi2ValueReference refs[], size_t count, int values[]",
    "GetString": "const fmi2ValueReference refs[], size_t count, const char *values[]",
    "SetInteger": "const fmi2ValueReference refs[], size_t count, const int values[]",
    "SetBoolean": "const fmi2ValueReference refs[], size_t count, const int values[]",
    "SetString": "const fmi2ValueReference refs[], size_t count, const char *const values[]",
    "GetDirectionalDerivative": "const fmi2ValueReference unknown[], size_t unknowns, "
    "const fmi2ValueReference known[], size_t knowns, const double change[], double result[]",
    "SetRealInputDerivatives": "const fmi2ValueReference refs[], size_t count, const int order[], "
    "const double values[]",
    "GetRealOutputDerivatives": "const fmi2ValueReference refs[], size_t count, const int order[], double values[]",
    "CancelStep": "",
    "GetStatus": "int kind, int *value",
    "GetRealStatus": "int kind, double *value",
    "GetIntegerStatus": "int kind, int *value",
    "GetBooleanStatus": "int kind, int *value",
    "GetStringStatus": "int kind, const char **value",
}
_TYPES = {
    "Float32": "float",
    "Int8": "int8_t",
    "UInt8": "uint8_t",
    "Int16": "int16_t",
    "UInt16": "uint16_t",
    "Int32": "int32_t",
    "UInt32": "uint32_t",
    "Int64": "int64_t",
    "UInt64": "uint64_t",
    "Boolean": "bool",
}
_CLOCKS = f"{_REFS}, "
FMI3 = {
    **{f"Get{name}": f"{_REFS}, {c} values[], {_N}" for name, c in _TYPES.items()},
    **{f"Set{name}": f"{_REFS}, const {c} values[], {_N}" for name, c in _TYPES.items()},
    "GetString": f"{_REFS}, const char *values[], {_N}",
    "SetString": f"{_REFS}, const char *const values[], {_N}",
    "GetBinary": f"{_REFS}, size_t sizes[], const uint8_t *values[], {_N}",
    "SetBinary": f"{_REFS}, const size_t sizes[], const uint8_t *const values[], {_N}",
    "GetClock": f"{_REFS}, bool values[]",
    "SetClock": f"{_REFS}, const bool values[]",
    "GetNumberOfVariableDependencies": "fmi3ValueReference ref, size_t *count",
    "GetVariableDependencies": "fmi3ValueReference ref, size_t elements[], fmi3ValueReference independents[], "
    "size_t independent_elements[], int kinds[], size_t count",
    "GetDirectionalDerivative": "const fmi3ValueReference unknown[], size_t unknowns, "
    "const fmi3ValueReference known[], size_t knowns, const double seed[], size_t seeds, "
    "double result[], size_t results",
    "GetAdjointDerivative": "const fmi3ValueReference unknown[], size_t unknowns, "
    "const fmi3ValueReference known[], size_t knowns, const double seed[], size_t seeds, "
    "double result[], size_t results",
    "EnterEventMode": "",
    "EnterConfigurationMode": "",
    "ExitConfigurationMode": "",
    "GetIntervalDecimal": f"{_CLOCKS}double intervals[], int qualifiers[]",
    "GetIntervalFraction": f"{_CLOCKS}uint64_t counters[], uint64_t resolutions[], int qualifiers[]",
    "GetShiftDecimal": f"{_CLOCKS}double shifts[]",
    "GetShiftFraction": f"{_CLOCKS}uint64_t counters[], uint64_t resolutions[]",
    "SetIntervalDecimal": f"{_CLOCKS}const double intervals[]",
    "SetIntervalFraction": f"{_CLOCKS}const uint64_t counters[], const uint64_t resolutions[]",
    "SetShiftDecimal": f"{_CLOCKS}const double shifts[]",
    "SetShiftFraction": f"{_CLOCKS}const uint64_t counters[], const uint64_t resolutions[]",
    "EvaluateDiscreteStates": "",
    "UpdateDiscreteStates": "bool *again, bool *terminate, bool *nominals, "
    "bool *values_changed, bool *defined, double *next",
    "EnterContinuousTimeMode": "",
    "CompletedIntegratorStep": "bool no_earlier, bool *event_mode, bool *terminate",
    "SetTime": "double time",
    "SetContinuousStates": f"const double states[], {_N}",
    "GetContinuousStateDerivatives": f"double rates[], {_N}",
    "GetEventIndicators": f"double indicators[], {_N}",
    "GetContinuousStates": f"double states[], {_N}",
    "GetNominalsOfContinuousStates": f"double nominals[], {_N}",
    "GetNumberOfEventIndicators": "size_t *count",
    "GetNumberOfContinuousStates": "size_t *count",
    "EnterStepMode": "",
    "GetOutputDerivatives": f"{_REFS}, const int32_t orders[], double values[], {_N}",
    "ActivateModelPartition": "fmi3ValueReference clock, double time",
}


def stubs(version: int) -> list[tuple[str, str, list[str]]]:
    """Name, arguments and their names of every function that is not supported."""
    table = FMI2 if version == 2 else FMI3
    return [(name, given, _names(given)) for name, given in table.items()]


def _names(given: str) -> list[str]:
    return [one.split()[-1].strip("*[]") for one in given.split(", ") if one]
