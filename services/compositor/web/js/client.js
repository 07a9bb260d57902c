// CompositorService as functions. The page talks to the origin that served it and to nobody else.

import * as m from './messages.js';
import { serverStream as callStream, unary as callUnary } from './grpc_web.js';

const method = (name) => `/tryon.v1.CompositorService/${name}`;

/**
 * @param {string} origin empty for the page's own origin; tests give another.
 * @param {string} token sent with every call; empty for none.
 */
export function compositor(origin = '', token = '') {
  const unary = (to, request, response, message, options) =>
    callUnary(to, request, response, message, { token, ...options });
  const serverStream = (to, request, response, message, options) =>
    callStream(to, request, response, message, { token, ...options });
  const url = (name) => origin + method(name);
  return {
    openTryOn: (request, options) =>
      unary(url('OpenTryOn'), m.OpenTryOnRequest, m.OpenTryOnResponse, request, options),
    closeTryOn: (request, options) =>
      unary(url('CloseTryOn'), m.CloseTryOnRequest, m.CloseTryOnResponse, request, options),
    withdrawConsent: (request, options) =>
      unary(url('WithdrawConsent'), m.WithdrawConsentRequest, m.WithdrawConsentResponse, request, options),
    chooseGarments: (request, options) =>
      unary(url('ChooseGarments'), m.ChooseGarmentsRequest, m.ChooseGarmentsResponse, request, options),
    showFit: (request, options) => unary(url('ShowFit'), m.ShowFitRequest, m.ShowFitResponse, request, options),
    listGarmentChoices: (options) =>
      unary(url('ListGarmentChoices'), m.ListGarmentChoicesRequest, m.ListGarmentChoicesResponse, {}, options),
    acknowledgeFrames: (request, options) =>
      unary(url('AcknowledgeFrames'), m.AcknowledgeFramesRequest, m.AcknowledgeFramesResponse, request, options),
    takeSnapshot: (request, options) =>
      unary(url('TakeSnapshot'), m.TakeSnapshotRequest, m.TakeSnapshotResponse, request, { timeoutMs: 10_000, ...options }),
    takeFinePicture: (request, options) =>
      serverStream(url('TakeFinePicture'), m.TakeFinePictureRequest, m.TakeFinePictureResponse, request, options),
    offerPhoto: (request, options) =>
      unary(url('OfferPhoto'), m.OfferPhotoRequest, m.OfferPhotoResponse, request, { timeoutMs: 10_000, ...options }),
    streamFrames: (request, options) =>
      serverStream(url('StreamFrames'), m.StreamFramesRequest, m.StreamFramesResponse, request, options),
  };
}
