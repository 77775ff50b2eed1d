"""Sign conventions and labelled side views of the bicycles, as text."""

CONVENTIONS = (
    "x points forward, y to the right, z down, from the contact of the rear wheel: heights are negative numbers",
    "lean phi is positive to the right, steer delta is positive to the right",
    "steer axis tilt lambda_s is positive as on ordinary bicycles, where the axis leans back at its top and its lower "
    "end points forward (normal rake); negative the other way (reversed rake)",
)
"""Signs as in Meijaard et al. (2007) and Kirillov (2018)."""

TMS = r"""
o--> x  (forward, with speed v)   steer axis \            :
|                                             \           :
v z  (down, with gravity g; y is to the right) \ lambda_s :
                                                \         :
                              o B: mass m_B      \        :
                              |                   \       :
                              |                    \      :
                              |                     \ <---- u_H ----> o H: mass m_H
                              |                      \    :           |
                              | -z_B                  \   :           |
                              |                        \  :           | -z_H
                              |                         \ :           |
                              |                          \:           |
----------R-----------------------------------------------F----------------------------- ground
          |<------ x_B ------>|
          |<--------------------- w --------------------->|
          |<-------------------------- x_H -------------------------->|
"""
"""The side view of the two-mass-skate bicycle."""

WHIPPLE = r"""
o--> x  (forward, with speed v)
|                                       steer axis  \     :
v z  (down, with gravity g; y is to the right)       \    : lambda_s: from the vertical to the axis
                                                      \   :
                                  o B: m_B, I_Bxx,     \  :
                                  |    I_Bzz, I_Bxz     \ :
    m_R, I_Rxx, I_Ryy             |                      \:               o H: m_H, I_Hxx, I_Hzz,
                                  |                       \               |    I_Hxz
       .-----.                    |                        \-----.        |
      /       \                   |                       / \     \       |
     |         |                  | -z_B                 |   \     |  m_F, I_Fxx, I_Fyy
     |    +    |                  |                      |    \    |      |
     |    |    |                  |                      |    |\   |      | -z_H
      \   | r_R                   |                       r_F | \ /       |
       '--|--'                    |                        '--|--\        |
----------R---------------------------------------------------F------------------------- ground
          |<-------- x_B -------->|                           |<c>|
          |<----------------------- w ----------------------->|
          |<---------------------------- x_H ---------------------------->|
"""
"""The side view of the Carvallo–Whipple bicycle."""
