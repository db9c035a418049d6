// SPDX-License-Identifier: Apache-2.0
// GDCM's headers, in whatever company they are compiled.
#pragma once
#if SCOLOPAX_HAS_GDCM
#include <byteswap.h>
// A header of OpenImageIO undefines these, which GDCM's headers use.
#ifndef bswap_16
#define bswap_16(x) __bswap_16(x)
#endif
#ifndef bswap_32
#define bswap_32(x) __bswap_32(x)
#endif
#ifndef bswap_64
#define bswap_64(x) __bswap_64(x)
#endif
#include <gdcmDataSet.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>
#endif
