"""The pushed object as a rigid body of six degrees of freedom on feet, moved by MuJoCo instead of the closed form."""
