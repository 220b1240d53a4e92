"""Pictures of the manual from real runs: commands on the shipped demonstration and small studies, with fixed seeds.

``python -m studies.manual.pictures`` runs the commands, for minutes, and stores the pictures in ``stored`` with what
made them; the manual is then built from these files alone. Each task is one module: its commands, its drawing and the
sentence that reads it. The studies are in ``inputs``.
"""
