"""The manager of a robot's controllers: its services, its control loop, and the programs that load and switch controllers."""
