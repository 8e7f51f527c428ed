"""What FlowRL's tests start from: a small method, a state off its start, a few transitions."""

from dataclasses import replace
from functools import cache

import equinox as eqx
import jax
from one_update import move, transitions

from hcpg.methods.flowrl import Config, FlowRL
from hcpg.types import Spec

ROWS, OBSERVATIONS, ACTIONS = 8, 5, 3
# Steps so large that a value from before an update cannot be taken for the one from after it.
TINY = Config(hidden_size=8, flow_steps=2, learning_rate=1e-2)
BATCH = transitions(ROWS, OBSERVATIONS, ACTIONS)


@cache
def method_of(weighting):
    return FlowRL(replace(TINY, weighting=weighting), Spec(OBSERVATIONS, ACTIONS))


@cache
def update_of(weighting):
    return jax.jit(method_of(weighting).update)


@cache
def moved_state():
    """A state whose every parameter is off its start, so that none can be left out unnoticed."""

    state = jax.jit(method_of("as_published").init)(jax.random.key(0))
    networks = state.actor, state.critic, state.buffer_critic, state.buffer_value
    actor, critic, buffer_critic, value = (move(each, seed, by=0.2) for seed, each in enumerate(networks))
    return state._replace(actor=actor, critic=critic, buffer_critic=buffer_critic, buffer_value=value)


def answering(network, answer):
    """The network with one answer to every input."""
    last = network.layers[-1]
    constant = last.kernel * 0, last.bias * 0 + answer
    return eqx.tree_at(lambda net: (net.layers[-1].kernel, net.layers[-1].bias), network, constant)
