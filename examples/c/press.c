/* Presses a body in this process: a frame of the full model every 50 ms, its patch at 1 kHz in between, as a client at a server
 * plays it.
 *
 * usage: press SCENE      cc press.c -lpalpate -o press
 */
#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>

enum { kTicks = 50, kFrames = 20 };

static void check(int result) {
  if (result == PALPATE_OK) return;
  fprintf(stderr, "press: %s\n", palpate_error());
  exit(result == PALPATE_BAD_INPUT ? 2 : 1);
}

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: press SCENE\n");
    return 2;
  }
  palpate_scene* scene;
  palpate_body* body;
  palpate_player* player = NULL;
  double home[3];
  palpate_tick felt = {.size = sizeof felt};
  const uint32_t hand = 1;
  check(palpate_scene_open(argv[1], &scene));
  check(palpate_scene_home(scene, home));
  check(palpate_body_new(scene, &body));
  palpate_scene_free(scene);
  for (int frame = 0; frame < kFrames; ++frame) {
    palpate_pose path[kTicks] = {0}; /* down by 30 mm within a second */
    for (int tick = 0; tick < kTicks; ++tick) {
      double* position = path[tick].position_m;
      position[0] = home[0];
      position[1] = home[1];
      position[2] = home[2] - 0.03 * (frame * kTicks + tick + 1) / (kFrames * kTicks);
      if (player) check(palpate_player_tick(player, &path[tick], &felt)); /* what the hand feels, with the last frame's patch */
    }
    check(palpate_body_step(body, NULL, 1, &hand, kTicks, path));
    palpate_tool tool = {.size = sizeof tool};
    check(palpate_body_tool(body, hand, &tool));
    printf("%4d ms: %.3f N", 50 * (frame + 1), tool.force_n[2]);
    if (player) printf(", felt %.3f N", felt.force_n[2]);
    printf("\n");
    palpate_player_free(player);
    player = NULL;
    if (tool.has_patch) check(palpate_player_new(body, hand, &player));
  }
  palpate_player_free(player);
  palpate_body_free(body);
  return 0;
}
