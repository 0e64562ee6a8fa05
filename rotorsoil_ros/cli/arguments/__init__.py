"""What may stand behind `rotorsoil`, and how a shell completes it."""
