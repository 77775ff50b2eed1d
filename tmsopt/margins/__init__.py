"""Distance to weave, capsize, infinity, heavy damping: the robustness radius."""
