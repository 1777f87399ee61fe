"""The emulated devices of a run or a rehearsal: opening them on one world, and what a person does to them."""
