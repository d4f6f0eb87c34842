"""Variables of MATLAB files; the ground motions read them too."""

from ground_motions.readers.mat_variables import mat_variables as mat_variables
