"""The grey-box protocol: how the diagnosis knows a plant."""
