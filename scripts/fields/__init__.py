"""The parts of scripts/generate-fields."""
