"""One run of an SBX algorithm on button-press, as a peer: prints JSON of its steady rate.

Usage: peer.py SAC|CrossQ SEED. Same task, sizes, batch, update ratio and number of environments as ours.
"""

import json
import sys
import time
import warnings

WARMUP_STEPS = 2_000
MEASURED_STEPS = 8_000


def main() -> None:
    """Train until compiled and warm, then time `MEASURED_STEPS` environment steps."""
    warnings.filterwarnings("ignore")
    import gymnasium
    import metaworld  # noqa: F401  registers the environments
    import sbx
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import DummyVecEnv

    class Clock(BaseCallback):
        """Notes the time at the end of the warm-up."""

        began = 0.0

        def _on_step(self) -> bool:
            if self.began == 0.0 and self.num_timesteps >= WARMUP_STEPS:
                self.began = time.perf_counter()
            return True

    name, seed = sys.argv[1], int(sys.argv[2])
    make = lambda: gymnasium.make("Meta-World/MT1", env_name="button-press-v3", seed=seed)  # noqa: E731
    options = {"train_freq": 1, "gradient_steps": 2, "batch_size": 256, "learning_starts": 500}
    policy = {"net_arch": [256, 256]}
    algorithm = getattr(sbx, name)("MlpPolicy", DummyVecEnv([make] * 8), policy_kwargs=policy, **options)
    print("ready", flush=True)
    sys.stdin.readline()
    clock = Clock()
    algorithm.learn(WARMUP_STEPS + MEASURED_STEPS, callback=clock)
    print(json.dumps({"steps_per_s": MEASURED_STEPS / (time.perf_counter() - clock.began)}))


if __name__ == "__main__":
    main()
