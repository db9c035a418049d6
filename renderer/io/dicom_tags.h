// SPDX-License-Identifier: Apache-2.0
// The DICOM elements that are read (dicom.nema.org, PS3.6), each with its keyword there.
#pragma once
#include <cstdint>

namespace scolopax::io {

/// Group and element.
struct DicomTag {
  std::uint16_t group = 0, element = 0;
};

namespace dicom {
inline constexpr DicomTag kTransferSyntax{0x0002, 0x0010};  // TransferSyntaxUID
inline constexpr DicomTag kImageType{0x0008, 0x0008};
inline constexpr DicomTag kSopClass{0x0008, 0x0016};  // SOPClassUID
inline constexpr DicomTag kModality{0x0008, 0x0060};
inline constexpr DicomTag kDescription{0x0008, 0x103e};   // SeriesDescription
inline constexpr DicomTag kThickness{0x0018, 0x0050};     // SliceThickness
inline constexpr DicomTag kSliceSpacing{0x0018, 0x0088};  // SpacingBetweenSlices
inline constexpr DicomTag kFrameTime{0x0018, 0x1063};
inline constexpr DicomTag kFrameTimes{0x0018, 0x1065};       // FrameTimeVector
inline constexpr DicomTag kDetectorSpacing{0x0018, 0x1164};  // ImagerPixelSpacing
inline constexpr DicomTag kSeriesUid{0x0020, 0x000e};        // SeriesInstanceUID
inline constexpr DicomTag kSeriesNumber{0x0020, 0x0011};
inline constexpr DicomTag kInstance{0x0020, 0x0013};          // InstanceNumber
inline constexpr DicomTag kPosition{0x0020, 0x0032};          // ImagePositionPatient
inline constexpr DicomTag kOrientation{0x0020, 0x0037};       // ImageOrientationPatient
inline constexpr DicomTag kTimeIndex{0x0020, 0x0100};         // TemporalPositionIdentifier
inline constexpr DicomTag kContentGroup{0x0020, 0x9111};      // FrameContentSequence
inline constexpr DicomTag kPositionGroup{0x0020, 0x9113};     // PlanePositionSequence
inline constexpr DicomTag kOrientationGroup{0x0020, 0x9116};  // PlaneOrientationSequence
inline constexpr DicomTag kContentTimeIndex{0x0020, 0x9128};  // TemporalPositionIndex
inline constexpr DicomTag kSamples{0x0028, 0x0002};           // SamplesPerPixel
inline constexpr DicomTag kPhotometric{0x0028, 0x0004};       // PhotometricInterpretation
inline constexpr DicomTag kFrames{0x0028, 0x0008};            // NumberOfFrames
inline constexpr DicomTag kRows{0x0028, 0x0010};
inline constexpr DicomTag kColumns{0x0028, 0x0011};
inline constexpr DicomTag kPixelSpacing{0x0028, 0x0030};
inline constexpr DicomTag kBitsAllocated{0x0028, 0x0100};
inline constexpr DicomTag kSigned{0x0028, 0x0103};     // PixelRepresentation
inline constexpr DicomTag kCenter{0x0028, 0x1050};     // WindowCenter
inline constexpr DicomTag kWidth{0x0028, 0x1051};      // WindowWidth
inline constexpr DicomTag kIntercept{0x0028, 0x1052};  // RescaleIntercept
inline constexpr DicomTag kSlope{0x0028, 0x1053};      // RescaleSlope
inline constexpr DicomTag kRescaleType{0x0028, 0x1054};
inline constexpr DicomTag kWindowFunction{0x0028, 0x1056};  // VOILUTFunction
inline constexpr DicomTag kModalityTable{0x0028, 0x3000};   // ModalityLUTSequence
inline constexpr DicomTag kMeasuresGroup{0x0028, 0x9110};   // PixelMeasuresSequence
inline constexpr DicomTag kWindowGroup{0x0028, 0x9132};     // FrameVOILUTSequence
inline constexpr DicomTag kRescaleGroup{0x0028, 0x9145};    // PixelValueTransformationSequence
inline constexpr DicomTag kDetectors{0x0054, 0x0022};       // DetectorInformationSequence
inline constexpr DicomTag kPetUnits{0x0054, 0x1001};        // Units
inline constexpr DicomTag kSegmentationType{0x0062, 0x0001};
inline constexpr DicomTag kSegments{0x0062, 0x0002};  // SegmentSequence
inline constexpr DicomTag kSegmentNumber{0x0062, 0x0004};
inline constexpr DicomTag kSegmentLabel{0x0062, 0x0005};
inline constexpr DicomTag kSegmentGroup{0x0062, 0x000a};       // SegmentIdentificationSequence
inline constexpr DicomTag kReferencedSegment{0x0062, 0x000b};  // ReferencedSegmentNumber
inline constexpr DicomTag kLargestFraction{0x0062, 0x000e};    // MaximumFractionalValue
inline constexpr DicomTag kDoseUnits{0x3004, 0x0002};
inline constexpr DicomTag kDoseOffsets{0x3004, 0x000c};   // GridFrameOffsetVector
inline constexpr DicomTag kDoseScaling{0x3004, 0x000e};   // DoseGridScaling
inline constexpr DicomTag kShared{0x5200, 0x9229};        // SharedFunctionalGroupsSequence
inline constexpr DicomTag kPerFrame{0x5200, 0x9230};      // PerFrameFunctionalGroupsSequence
inline constexpr DicomTag kFloatPixels{0x7fe0, 0x0008};   // FloatPixelData
inline constexpr DicomTag kDoublePixels{0x7fe0, 0x0009};  // DoubleFloatPixelData
inline constexpr DicomTag kPixels{0x7fe0, 0x0010};        // PixelData
}  // namespace dicom

}  // namespace scolopax::io
