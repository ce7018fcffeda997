"""What tests share: inputs with known truth, slow twins, judges, and peers that run beside us."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
