"""Put the selector around a PyTorch flow policy of your own: `python examples/wrap_torch_policy.py`."""

import torch

from hcpg.selection import Scene, select

flow = torch.nn.Sequential(torch.nn.Linear(13, 64), torch.nn.SiLU(), torch.nn.Linear(64, 4), torch.nn.Tanh())


def act(observation: torch.Tensor, candidates: int = 4) -> torch.Tensor:
    """The action to execute; of the observation, the first nine numbers are tool, object and goal, m."""
    noise = torch.randn(candidates, 4)
    proposals = flow(torch.cat([observation.expand(candidates, -1), noise], dim=-1))
    scene = Scene.of(tool=observation[0:3], object=observation[3:6], goal=observation[6:9])
    return select(proposals, scene)[0]


with torch.no_grad():
    action = act(torch.tensor([0.0, 0.0, 0.3, 0.1, 0.4, 0.02, 0.0, 0.6, 0.02]))
print(action.tolist())  # noqa: T201 - a script's answer
