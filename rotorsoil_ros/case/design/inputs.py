"""What may be uncertain of a machine, in the words of an engineer, and how one knows it better."""

from dataclasses import dataclass

from rotorsoil_ros.machine.spread import OF_LAYER, SoilSpread


@dataclass(frozen=True, slots=True)
class UncertainInput:
    """
    One input of a machine that may not be known.

    Attributes
    ----------
    words : str
        How it is called.
    low, high : str
        What its lower and its higher end are called.
    advice : str
        How one gets to know it better.

    """

    words: str
    low: str
    high: str
    advice: str


# By the key of `uncertainty` that says how badly it is known.
INPUTS = {
    'shear_modulus_factor': UncertainInput(
        'stiffness of the soil', 'softest soil', 'stiffest soil',
        'measure the velocity of shear waves on site (MASW, cross-hole or seismic cone)'),
    'rock_depth': UncertainInput(
        'depth of rock', 'shallowest rock', 'deepest rock',
        'sink a bore hole to twice the width of the block below its base'),
    'side_contact': UncertainInput(
        'contact of the wall', 'least welded wall', 'most welded wall',
        'ask how the excavation beside the block was filled and compacted'),
    'ground_water': UncertainInput(
        'ground water', 'dry soil', 'ground water at the surface',
        'ask for the ground water level over the year'),
    'poisson_ratio': UncertainInput(
        "Poisson's ratio of the soil", 'lowest nu', 'highest nu',
        'ask for the ground water level: below it take 0.49 for clay'),
    'loss_factor': UncertainInput(
        'damping of the soil', 'least damping', 'most damping',
        'ask for a resonant column test of the soil'),
    'soil_density_factor': UncertainInput(
        'density of the soil', 'lightest soil', 'heaviest soil', 'take it from the soil report'),
    'bearing_stiffness_factor': UncertainInput(
        'bearing stiffness', 'softest bearings', 'stiffest bearings',
        'ask the maker of the bearings for their stiffness at this load'),
    'bearing_damping_factor': UncertainInput(
        'bearing damping', 'least bearing damping', 'most bearing damping',
        'ask the maker of the bearings for their damping at this speed'),
    'pedestal_stiffness_factor': UncertainInput(
        'stiffness of the pedestals', 'softest pedestals', 'stiffest pedestals',
        'strike the pedestals with an instrumented hammer, or compute them from their drawing'),
    'foundation_mass_factor': UncertainInput(
        'mass of the foundation', 'lightest foundation', 'heaviest foundation',
        'take the mass of what stands on the block from its drawings'),
    'foundation_stiffness_factor': UncertainInput(
        'stiffness of the foundation', 'softest foundation', 'stiffest foundation',
        'strike the foundation with an instrumented hammer and hold it against `seats`'),
    'rotor_mass_factor': UncertainInput(
        'mass of the rotor', 'lightest rotor', 'heaviest rotor',
        'take mass and inertia of the rotor from its drawing, or weigh it'),
    'shaft_stiffness_factor': UncertainInput(
        'bending stiffness of the shaft', 'most slender shaft', 'stoutest shaft',
        'take diameters and distances of the bearings from the shaft drawing'),
    'shaft_height_factor': UncertainInput(
        'height of the shaft', 'lowest shaft', 'highest shaft',
        'take the height of the shaft from the general arrangement drawing'),
    'unbalance_factor': UncertainInput(
        'unbalance', 'least unbalance', 'most unbalance',
        'agree a balance grade with the maker, and balance the rotor in place'),
}


def key_of(name: str) -> str:
    """Return the key of `uncertainty` that an input of a spread belongs to."""
    return OF_LAYER if SoilSpread.layer_of(name) else name


def input_of(name: str) -> UncertainInput:
    """Return what an input of a spread is, that of a layer too."""
    layer = SoilSpread.layer_of(name)
    if layer is None:
        return INPUTS[name]
    return UncertainInput(
        f'stiffness of layer {layer}', f'softest layer {layer}', f'stiffest layer {layer}',
        'measure the velocity of shear waves down a bore hole (down-hole, cross-hole or seismic '
        'cone)')
