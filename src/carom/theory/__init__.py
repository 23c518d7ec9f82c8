"""What is known about hard particles: equations of state, contact values, collision rates; with sources.

An equation of state here is a function from the packing fraction ``eta`` of infinitely many particles to the
compressibility factor ``Z = P V / (N kT)``. It takes a float or an array and returns the same kind. No
equation includes freezing. Those of the fluid are meant for the stable fluid: up to eta = 0.69 (2D, less
accurate from 0.6 on), 0.494 (3D), about 0.29 (4D), 0.17 (5D) and 0.10 (6D). Those of the solid are meant from
0.545 (3D) to close packing. Nothing here simulates or measures.
"""

from carom.theory import arithmetic
from carom.theory.arithmetic import Equation
from carom.theory.choice import (
    CLOSE_PACKING,
    FREEZING,
    MELTING,
    NEAR_FREEZING,
    best,
    equations,
    is_stable_fluid,
    solid,
)
from carom.theory.coexistence import Coexistence, coexistence
from carom.theory.contact import (
    ball_volume,
    collision_rate,
    compressibility_factor,
    contact_value,
    mean_free_time,
)
from carom.theory.finite_size import (
    constant_pressure_shift,
    crystal_finite_size_shift,
    finite_size_shift,
    speed_factor,
)
from carom.theory.fluid import (
    carnahan_starling,
    henderson,
    kolafa_labik_malijevsky,
    pieprzyk,
    santos_lopez_de_haro_yuste,
    tonks,
)
from carom.theory.mixture import (
    bmcsl,
    bmcsl_contact_value,
    jenkins_mancini,
    mixture_second_virial,
    santos_yuste_lopez_de_haro,
    santos_yuste_lopez_de_haro_contact_value,
    species_collision_rate,
)
from carom.theory.mixture_size import mixture_finite_size_shift
from carom.theory.solid import almarza, free_volume, hall, speedy
from carom.theory.structure import structure_factor
from carom.theory.transport import (
    Enskog,
    diffusion_shift,
    enskog,
    erpenbeck_wood,
    normal_speed,
    velocity_tail,
)
from carom.theory.virial import virial_coefficients, virial_pade, virial_series

__all__ = [
    "CLOSE_PACKING",
    "FREEZING",
    "MELTING",
    "NEAR_FREEZING",
    "Coexistence",
    "Enskog",
    "Equation",
    "almarza",
    "ball_volume",
    "best",
    "bmcsl",
    "bmcsl_contact_value",
    "carnahan_starling",
    "coexistence",
    "collision_rate",
    "compressibility_factor",
    "constant_pressure_shift",
    "contact_value",
    "crystal_finite_size_shift",
    "diffusion_shift",
    "enskog",
    "equations",
    "erpenbeck_wood",
    "finite_size_shift",
    "free_volume",
    "hall",
    "henderson",
    "is_stable_fluid",
    "jenkins_mancini",
    "kolafa_labik_malijevsky",
    "mean_free_time",
    "mixture_finite_size_shift",
    "mixture_second_virial",
    "normal_speed",
    "pieprzyk",
    "santos_lopez_de_haro_yuste",
    "santos_yuste_lopez_de_haro",
    "santos_yuste_lopez_de_haro_contact_value",
    "solid",
    "species_collision_rate",
    "speed_factor",
    "speedy",
    "structure_factor",
    "tonks",
    "velocity_tail",
    "virial_coefficients",
    "virial_pade",
    "virial_series",
]

globals().update({name: arithmetic.of_numbers(globals()[name]) for name in __all__})
