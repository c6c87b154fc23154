"""FMUs of both FMI versions, imported by FMPy."""

import fmpy
import numpy as np
import pytest
from fmpy import fmi2, fmi3


class Importer:
    """An unpacked FMU with any number of instances."""

    def __init__(self, file):
        self.description = fmpy.read_model_description(str(file))
        self.folder = fmpy.extract(str(file))
        self.references = {variable.name: variable.valueReference for variable in self.description.modelVariables}
        self.version = 2 if self.description.fmiVersion.startswith("2") else 3

    def names(self, kind):
        return [name for name in self.references if name.startswith(kind + ".")]

    def instance(self, start=0.0, **parameters):
        it = self.bare()
        it.set(parameters)
        it.begin(start)
        return it

    def bare(self, token=None):
        return Instance(self, token)


class Instance:
    """Common interface for instances of both FMI versions."""

    def __init__(self, of, token):
        self.of, self.messages = of, []
        place = {"guid": token or of.description.guid, "unzipDirectory": of.folder, "modelIdentifier": of.description.coSimulation.modelIdentifier}
        if of.version == 2:
            log = lambda environment, name, status, category, message: self.messages.append(message.decode())  # noqa: E731
            self.callbacks = fmi2.fmi2CallbackFunctions()
            self.callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(log)
            self.callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
            self.callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
            self.fmu = fmi2.FMU2Slave(instanceName="one", **place)
            self.fmu.instantiate(callbacks=self.callbacks)
        else:
            log = lambda environment, status, category, message: self.messages.append(message.decode())  # noqa: E731
            self.fmu = fmi3.FMU3Slave(instanceName="one", **place)
            self.fmu.instantiate(logMessage=log)

    def begin(self, start=0.0):
        if self.of.version == 2:
            self.fmu.setupExperiment(startTime=start)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start)
        self.fmu.exitInitializationMode()

    def set(self, values):
        names = list(values)
        self.put([self.of.references[name] for name in names], [values[name] for name in names])

    def put(self, references, values):
        (self.fmu.setReal if self.of.version == 2 else self.fmu.setFloat64)(references, values)

    def get(self, names):
        return self.take([self.of.references[name] for name in names])

    def take(self, references):
        return np.array((self.fmu.getReal if self.of.version == 2 else self.fmu.getFloat64)(references))

    def step(self, point, length):
        self.fmu.doStep(point, length)

    def state(self):
        return self.fmu.getFMUState()

    def restore(self, state):
        self.fmu.setFMUState(state)

    def saved(self):
        state = self.state()
        saved = self.fmu.serializeFMUState(state)
        self.fmu.freeFMUState(state)
        return saved

    def restore_saved(self, saved):
        state = self.fmu.deserializeFMUState(saved)
        self.restore(state)
        self.fmu.freeFMUState(state)

    def free(self):
        self.fmu.freeInstance()

    def refused(self, words, act, *arguments):
        """Assert that a call fails with an error and a message that contains these words."""
        self.messages.clear()
        with pytest.raises(Exception):
            act(*arguments)
        assert any(words in message for message in self.messages), self.messages
