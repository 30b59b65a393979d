// SPDX-License-Identifier: MIT
// The loader of Vulkan functions, built here from its system header. It opens libvulkan at run time, so a program that
// links us also starts on a machine without Vulkan.
#define VOLK_IMPLEMENTATION
#include <volk.h>
