/* SPDX-License-Identifier: GPL-3.0-or-later
 * The C interface from C: a block of 30 x 20 x 10 mm with crystal in it, its layers in strips, what it says of a wrong
 * recipe, and a cancelled job. Exit code 0 if all is as it should be. */
#include <fibrolite/slicer.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

static void expect(int holds, const char* what) {
  if (holds) return;
  fprintf(stderr, "not so: %s (last message: %s)\n", what, fibrolite_last_message());
  ++failures;
}

static void watch(double fraction, const char* stage, void* user) {
  (void)stage;
  *(double*)user = fraction;
}

int main(void) {
  static const float vertices[] = {0, 0, 0, 30, 0, 0, 30, 20, 0, 0, 20, 0, 0, 0, 10, 30, 0, 10, 30, 20, 10, 0, 20, 10};
  static const uint32_t triangles[] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                       1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
  const fibrolite_mesh block = {vertices, 8, triangles, 12};
  fibrolite_options options = {0};
  options.infill = "tcs";
  options.voxel_mm = 0.25;
  options.pixel_x_mm = 0.1;
  options.layer_mm = 0.2;

  double progress = 0;
  fibrolite_job* job = fibrolite_job_new(watch, &progress);
  expect(fibrolite_job_open_mesh(job, &block, &options) == FIBROLITE_OK, "the block opens");
  expect(progress == 1, "progress ends at 1");
  fibrolite_layers layers;
  expect(fibrolite_job_layers(job, &layers) == FIBROLITE_OK, "the layers are known");
  expect(layers.layers == 50 && layers.width == 300 && layers.height == 200, "50 layers of 300 x 200 pixels");

  /* Strips of 64 rows, one above the other in one buffer. */
  uint8_t* rows = malloc((size_t)layers.width * (size_t)layers.height);
  double volume = 0, counted = 0;
  for (int n = 0; n < layers.layers; ++n) {
    for (int y = 0; y < layers.height; y += 64) {
      const int height = layers.height - y < 64 ? layers.height - y : 64;
      double area = 0;
      expect(fibrolite_job_tile(job, n, 0, y, layers.width, height, rows + (size_t)y * (size_t)layers.width,
                                (size_t)layers.width, &area) == FIBROLITE_OK,
             "a strip is given");
      volume += area * layers.layer_mm;
    }
    for (int i = 0; i < layers.width * layers.height; ++i) counted += rows[i] / 255.0;
  }
  counted *= layers.pixel_x_mm * layers.pixel_y_mm * layers.layer_mm;
  printf("%d layers: %.1f mm3 by areas, %.1f by pixels, %.1f by the solid, of 6000\n", layers.layers, volume, counted,
         layers.volume_mm3);
  expect(volume > 0.99 * layers.volume_mm3 && volume < 1.01 * layers.volume_mm3, "areas add up to the volume");
  expect(counted > 0.999 * volume && counted < 1.001 * volume, "and so do pixels");
  expect(volume > 1500 && volume < 5000, "the block is neither empty nor full");
  expect(fibrolite_job_tile(job, 50, 0, 0, 1, 1, rows, 1, NULL) == FIBROLITE_BAD_ARGUMENT, "there is no layer 50");
  expect(fibrolite_job_tile(job, 0, 0, 0, 1, 1, NULL, 1, NULL) == FIBROLITE_BAD_ARGUMENT, "there must be rows");
  expect(fibrolite_job_tile(job, 0, 0, 0, 2, 1, rows, 1, NULL) == FIBROLITE_BAD_ARGUMENT, "rows hold the width");
  expect(fibrolite_job_tile(job, 0, INT_MAX, 0, 1, 1, rows, 1, NULL) == FIBROLITE_BAD_ARGUMENT, "no pixel is so far");
  expect(fibrolite_job_layers(NULL, &layers) == FIBROLITE_BAD_ARGUMENT, "there must be a job");
  free(rows);
  fibrolite_job_free(job);
  fibrolite_job_free(NULL);

  job = fibrolite_job_new(NULL, NULL);
  options.recipe = "{\"tcs\": {\"cell\": 5}}";
  expect(fibrolite_job_open_mesh(job, &block, &options) == FIBROLITE_BAD_RECIPE, "a wrong key is a bad recipe");
  expect(strstr(fibrolite_last_message(), "tcs.cell_mm") != NULL, "and the message names the right one");
  fibrolite_job_free(job);

  job = fibrolite_job_new(NULL, NULL);
  options.recipe = NULL;
  fibrolite_job_cancel(job);
  expect(fibrolite_job_open_mesh(job, &block, &options) == FIBROLITE_CANCELLED, "a cancelled job does not open");
  fibrolite_job_free(job);
  return failures == 0 ? 0 : 1;
}
