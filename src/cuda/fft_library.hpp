// cuFFT, or in tests its emulation over FFTW.
#pragma once

#if defined(BRECCIA_CUDA_EMULATED)
#include "tests/cuda/emulation/fft_api.hpp"
#else
#include <cufft.h>
#endif
