/* A station at a server whose hand is this program, beside a viewer: pulls the grasped node up by 10 mm, and prints what it feels
 * and what the viewer sees.
 *
 * usage: station HOST:PORT      cc station.c -lpalpate -lm -o station
 */
#define _POSIX_C_SOURCE 200112L
#include <math.h>
#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static void check(int result) {
  if (result == PALPATE_OK) return;
  fprintf(stderr, "station: %s\n", palpate_error());
  exit(result == PALPATE_BAD_INPUT ? 2 : 1);
}

static void wait_for_next_tick(struct timespec* due) {
  due->tv_nsec += 1000000;
  if (due->tv_nsec >= 1000000000) {
    due->tv_nsec -= 1000000000;
    ++due->tv_sec;
  }
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, due, NULL) != 0) {
  }
}

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: station HOST:PORT\n");
    return 2;
  }
  palpate_client* client;
  palpate_viewer* viewer;
  palpate_client_options options = {.size = sizeof options, .server = argv[1], .station = "c"};
  palpate_viewer_options viewing = {.size = sizeof viewing, .server = argv[1]};
  palpate_tick tick = {.size = sizeof tick};
  palpate_pose pose = {0};
  double home[3], most_n = 0;
  check(palpate_client_join(&options, &client));
  check(palpate_client_wait(client, 10));
  check(palpate_client_home(client, home));
  check(palpate_viewer_join(&viewing, &viewer));
  check(palpate_viewer_wait(viewer, 10));

  for (int axis = 0; axis < 3; ++axis) pose.position_m[axis] = home[axis];
  struct timespec due;
  clock_gettime(CLOCK_MONOTONIC, &due);
  for (int k = 0; k < 10000 && !tick.has_patch; ++k) { /* at rest until the first patch is there */
    wait_for_next_tick(&due);
    check(palpate_client_tick(client, &pose, &tick));
  }
  for (int k = 0; k <= 1000; ++k) {
    pose.position_m[2] = home[2] + 0.01 * k / 1000;
    wait_for_next_tick(&due);
    check(palpate_client_tick(client, &pose, &tick));
    const double n =
        sqrt(tick.force_n[0] * tick.force_n[0] + tick.force_n[1] * tick.force_n[1] + tick.force_n[2] * tick.force_n[2]);
    if (n > most_n) most_n = n;
  }
  int32_t shown;
  size_t vertices, triangles, tools;
  const float* positions;
  const uint32_t* corners;
  const char* station;
  palpate_tool tool = {.size = sizeof tool};
  check(palpate_viewer_update(viewer, 0.2, &shown));
  check(palpate_viewer_triangles(viewer, &corners, &triangles));
  check(palpate_viewer_shape(viewer, &positions, &vertices));
  check(palpate_viewer_tools(viewer, &tools));
  check(palpate_viewer_tool(viewer, 0, &tool, &station));
  printf("felt at most %.2f N; %zu triangles over %zu vertices; %zu tool, \"%s\", %.1f mm above its start\n", most_n, triangles,
         vertices, tools, station, 1e3 * (tool.position_m[2] - home[2]));
  palpate_viewer_free(viewer);
  palpate_client_free(client);
  return shown ? 0 : 1;
}
