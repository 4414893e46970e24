// Runs ViSP's model-based tracker (vpMbGenericTracker, KLT points on faces, two cameras) on pictures
// that come through a pipe.
//
// usage: surface_tracker FOCAL_PX CENTRE_X_PX CENTRE_Y_PX WIDTH HEIGHT BASELINE_M MODEL.cao
//
// The pictures are rectified, grey, row by row, the left one before the right one. On stdin: a line
// with 16 numbers, the pose (left camera from bone, m, by rows) in the first pair; then all pairs.
// On stdout a line for each pair after the first one: the 16 numbers of its pose, or "lost".

#include <cstdio>
#include <iostream>
#include <string>

#include <visp3/core/vpCameraParameters.h>
#include <visp3/core/vpImage.h>
#include <visp3/klt/vpKltOpencv.h>
#include <visp3/mbt/vpMbGenericTracker.h>

namespace {

using Picture = vpImage<unsigned char>;

bool read_pose(vpHomogeneousMatrix &pose) {
  for (unsigned i = 0; i < 16; ++i)
    if (std::scanf("%lf", &pose[i / 4][i % 4]) != 1) return false;
  return std::getc(stdin) == '\n';
}

void write_pose(const vpHomogeneousMatrix &pose) {
  for (unsigned i = 0; i < 16; ++i) std::printf("%.12g ", pose[i / 4][i % 4]);
  std::printf("\n");
}

bool read_pair(Picture &left, Picture &right) {
  return std::fread(left.bitmap, 1, left.getSize(), stdin) == left.getSize() &&
         std::fread(right.bitmap, 1, right.getSize(), stdin) == right.getSize();
}

vpKltOpencv make_klt() {
  vpKltOpencv klt;
  klt.setMaxFeatures(1500);
  klt.setWindowSize(11);
  klt.setQuality(0.005);
  klt.setMinDistance(4);
  klt.setHarrisFreeParameter(0.01);
  klt.setBlockSize(3);
  klt.setPyramidLevels(3);
  return klt;
}

} // namespace

int main(int count, char **values) {
  if (count != 8) {
    std::fprintf(stderr, "usage: surface_tracker FOCAL_PX CENTRE_X_PX CENTRE_Y_PX WIDTH HEIGHT "
                         "BASELINE_M MODEL.cao\n");
    return 2;
  }
  std::cout.rdbuf(std::cerr.rdbuf()); // what ViSP says must not be taken for poses
  const double focal_px = std::stod(values[1]);
  const vpCameraParameters camera(focal_px, focal_px, std::stod(values[2]), std::stod(values[3]));
  const unsigned width = std::stoul(values[4]), height = std::stoul(values[5]);
  vpHomogeneousMatrix right_from_left;
  right_from_left[0][3] = -std::stod(values[6]);

  vpMbGenericTracker tracker(2, vpMbGenericTracker::KLT_TRACKER);
  tracker.setCameraParameters(camera, camera);
  tracker.setCameraTransformationMatrix("Camera2", right_from_left);
  tracker.setKltOpencv(make_klt());
  tracker.setKltMaskBorder(2);
  tracker.setAngleAppear(vpMath::rad(70.0));
  tracker.setAngleDisappear(vpMath::rad(75.0));
  tracker.setNearClippingDistance(0.01);
  tracker.setFarClippingDistance(10.0);
  tracker.loadModel(values[7], values[7]);

  Picture left(height, width), right(height, width);
  vpHomogeneousMatrix pose;
  if (!read_pose(pose) || !read_pair(left, right)) return 1;
  tracker.initFromPose(left, right, pose, right_from_left * pose);
  while (read_pair(left, right)) {
    try {
      tracker.track(left, right);
      tracker.getPose(pose);
      write_pose(pose);
    } catch (const vpException &) {
      // It goes on from its last pose.
      tracker.initFromPose(left, right, pose, right_from_left * pose);
      std::printf("lost\n");
    }
    std::fflush(stdout);
  }
  return 0;
}
